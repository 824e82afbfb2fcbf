"""The commands of `aero-hil`: those of this package, and those that other packages bring.

A package brings commands with an entry point of the group `aero_hil.commands`, which names a table as `OWN` is.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.metadata import entry_points
from typing import NamedTuple

GROUP = "aero_hil.commands"
PACKAGES = ("aero", "firmware_emulator", "model", "hil")


class Command(NamedTuple):
    """One command; its module is imported only when it is used."""

    place: str
    """`module:attribute`."""
    summary: str
    """Its line in the list of commands."""
    extra: str = "hil"
    """Extra that its imports come with."""


OWN: dict[str, Command] = {
    "doctor": Command("hil.cli.doctor:doctor", "Look at this machine and a hand at rest, and say what to do."),
    "validate": Command("hil.cli.validate:validate", "Check a hand, real or emulated, against its limits."),
    "diagnose": Command("hil.cli.diagnose:diagnose", "Isolate the part at fault of a hand that failed, step by step."),
    "report": Command("hil.cli.report:report", "Judge recordings again and write the report."),
    "view": Command("hil.cli.view:view", "Play a recording in a web page.", "view"),
    "export": Command("hil.cli.export:export_command", "Write a recording for Foxglove, or a film of it.", "foxglove"),
    "replay": Command("hil.cli.replay:replay", "Send the bytes of a recording to a hand again."),
    "baseline": Command("hil.cli.baseline:baseline", "Store a hand's figures, to compare with later."),
    "emulate": Command("hil.cli.emulate:emulate", "Serve an emulated hand on a port.", "emulate"),
    "faults": Command(
        "hil.cli.faults:faults", "List the faults that can be injected into a hand or a link.", "emulate"
    ),
    "proxy": Command("hil.cli.proxy:proxy", "Inject faults between a program and a port.", "emulate"),
    "firmware": Command("hil.cli.firmware:firmware", "Build a firmware of your own, and compare two."),
    "run-policy": Command("hil.cli.run_policy:run_policy", "Run a policy on a hand."),
}


@cache
def commands() -> Mapping[str, Command]:
    """Return every command by name, in the order in which they are listed."""
    brought = [point.load() for point in sorted(entry_points(group=GROUP), key=lambda point: point.name)]
    return OWN | {name: row for table in brought for name, row in table.items()}


def is_ours(module: str | None) -> bool:
    """Return whether a module is of aero-hil: where it cannot be imported, it is a defect and no missing extra."""
    top = (module or "").partition(".")[0]
    return top in PACKAGES or top in {point.module.partition(".")[0] for point in entry_points(group=GROUP)}
