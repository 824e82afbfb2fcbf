"""Commands of `aero-hil`: those of this package and those of other packages.

A package adds commands with an entry point of the group `aero_hil.commands` that names a table like `OWN`.
"""

from collections.abc import Mapping
from functools import cache
from typing import NamedTuple

from aero.printable import printable
from hil.cli.exits import ctrl_c_exits
from hil.targets.brought import points_of

GROUP = "aero_hil.commands"


class Command(NamedTuple):
    """Command whose module is imported on use."""

    place: str
    """Location of the command, `module:attribute`."""
    summary: str
    extra: str = "hil"
    """Extra that provides the command's imports."""


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
    """All commands by name, in listing order."""

    rows: Mapping[str, Command]
    losses: tuple[str, ...]
    """One line for each unusable package or command."""


def find_command(name: str) -> Command | None:
    """Return a command by name; tables of entry points are loaded only for a name that `OWN` lacks."""
    return OWN.get(name) or brought().rows.get(name)


def commands() -> Mapping[str, Command]:
    """Return all commands by name, in listing order."""
    return brought().rows


@cache
def brought() -> Brought:
    """Return `OWN` and the commands of entry points; existing names are kept."""
    rows, losses = dict(OWN), []
    for package, point in sorted(points_of(GROUP), key=lambda found: (found[0] != "aero-hil", found[1].name)):
        try:
            with ctrl_c_exits():
                table = {name: Command(*row) for name, row in point.load().items()}
        except Exception as error:  # whatever a module of another package raises
            losses.append(f"commands of the package `{package}` are left out: {named(error)}")
            continue
        if taken := sorted(rows.keys() & table.keys()):
            losses.append(f"`{', '.join(taken)}` of the package `{package}` is left out: there is one already")
        rows |= {name: row for name, row in table.items() if name not in rows}
    return Brought(rows, tuple(losses))


def named(error: BaseException) -> str:
    """Return type and message of an error in one line."""
    return printable(" ".join(f"{type(error).__name__}: {error}".split()).rstrip(": "))
