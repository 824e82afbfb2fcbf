"""Commands of `aero-hil`: those of this package and those of other packages.

A package adds commands with an entry point of the group `aero_hil.commands` that names a table like `OWN`.
"""

import re
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.metadata import EntryPoint, PackageNotFoundError, distribution
from typing import Any, NamedTuple

from aero.printable import printable
from hil.cli.exits import ctrl_c_exits
from hil.targets.brought import points_of

GROUP = "aero_hil.commands"
DISTRIBUTION = "aero-hil"
NAME = re.compile(r"[a-z0-9][a-z0-9_-]*")


class Command(NamedTuple):
    """Command whose module is imported on use."""

    place: str
    """Location of the command, `module:attribute`."""
    summary: str
    extra: str = "hil"
    """Extra that provides the command's imports."""
    package: str = DISTRIBUTION
    """Distribution that provides the command; set when its table is loaded."""


OWN: dict[str, Command] = {
    "setup": Command("hil.cli.setup:setup", "Set up a new hand: port, firmware, homing, name."),
    "doctor": Command("hil.cli.doctor:doctor", "Examine this machine and a hand at rest; print remedies."),
    "validate": Command("hil.cli.validate:validate", "Check a hand, real or emulated, against its limits."),
    "diagnose": Command("hil.cli.diagnose:diagnose", "Isolate the faulty part of a hand, step by step."),
    "report": Command("hil.cli.report:report", "Judge recordings again and write the report."),
    "view": Command("hil.cli.view:view", "Play a recording in a web page; show a port live."),
    "export": Command("hil.cli.export:export_command", "Write a recording for Foxglove, or a film."),
    "baseline": Command("hil.cli.baseline:baseline", "Store a hand's figures for later comparison."),
    "history": Command("hil.cli.history:history", "Show a hand's readings over its runs, and drifts."),
    "guard": Command("hil.cli.guard:guard", "Guard a hand for any program on its port."),
    "emulate": Command("hil.emulated.cli.emulate:emulate", "Serve an emulated hand on a port.", "emulate"),
    "faults": Command(
        "hil.emulated.cli.faults:faults", "List the faults that can be injected into a hand or a link.", "emulate"
    ),
    "proxy": Command("hil.emulated.cli.proxy:proxy", "Inject faults between a program and a port.", "emulate"),
    "firmware": Command("hil.emulated.cli.firmware:firmware", "Build your own firmware; compare two firmwares."),
    "run-policy": Command("hil.cli.run_policy:run_policy", "Run a policy on a hand."),
}


class Brought(NamedTuple):
    """Commands loaded from entry points."""

    rows: Mapping[str, Command]
    losses: tuple[str, ...]
    """One line for each unusable package or command."""


def find_command(name: str) -> Command | None:
    """Return a command by name; other packages are loaded only if aero-hil has no such command."""
    return _ours().rows.get(name) or brought().rows.get(name)


def commands() -> Mapping[str, Command]:
    """Return all commands by name, in listing order."""
    return brought().rows


@cache
def _ours() -> Brought:
    """Return the commands of aero-hil's own distribution, including those of `train`."""
    try:
        points = distribution(DISTRIBUTION).entry_points.select(group=GROUP)
    except PackageNotFoundError:  # run from a folder without installation
        return Brought(OWN, ())
    return _with_tables(Brought(OWN, ()), [(DISTRIBUTION, point) for point in points])


@cache
def brought() -> Brought:
    """Return the commands of aero-hil and of all other packages."""
    return _with_tables(
        _ours(),
        sorted((found for found in points_of(GROUP) if found[0] != DISTRIBUTION), key=lambda found: found[1].name),
    )


def _with_tables(known: Brought, points: Iterable[tuple[str, EntryPoint]]) -> Brought:
    """Return `known` with the commands of the entry points added; existing names are kept."""
    rows, losses = dict(known.rows), list(known.losses)
    for package, point in points:
        try:
            with ctrl_c_exits():
                table = _checked(point.load())
        except BaseException as error:  # also SystemExit: a package must not end other packages' commands
            losses.append(f"commands of the package `{package}` are left out: {named(error)}")
            continue
        if taken := sorted(rows.keys() & table.keys()):
            losses.append(f"`{', '.join(taken)}` of the package `{package}` is left out: there is one already")
        rows |= {name: row._replace(package=package) for name, row in table.items() if name not in rows}
    return Brought(rows, tuple(losses))


def _checked(table: Any) -> dict[str, Command]:
    """Return a validated table of another package.

    Raises:
        TypeError: something that is not a table of commands.
    """
    if not isinstance(table, Mapping):
        raise TypeError(f"{type(table).__name__} in place of a table of commands")
    for name, row in table.items():
        if not (isinstance(name, str) and NAME.fullmatch(name) and isinstance(row, Command) and ":" in row.place):
            raise TypeError(f"{name!r}: {row!r} is not a command")
    return {name: row._replace(summary=" ".join(printable(row.summary).split())) for name, row in table.items()}


def named(error: BaseException) -> str:
    """Return type and message of an error in one line."""
    return printable(" ".join(f"{type(error).__name__}: {error}".split()).rstrip(": "))
