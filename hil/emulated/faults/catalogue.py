"""Catalogue of all faults by name, and the parser of fault texts."""

import re
from collections.abc import Mapping
from typing import TypeVar

from aero.channels import CABLES, FINGERS, Channel
from aero_hil_toml import meant
from hil.emulated.faults import board, bus, encoder, host, link, mechanics, motor, servo, supply, winding
from hil.emulated.faults.fault import ALL, STEPS, Fault, Injection
from hil.targets.brought import brought, leave_out

Known = TypeVar("Known")
CATALOGUE: dict[str, Fault] = {
    fault.name: fault
    for file in (mechanics, winding, motor, encoder, supply, servo, bus, board, link, host)
    for fault in file.FAULTS
}
for _package, _table in brought("aero_hil.faults"):
    for _fault in _table if isinstance(_table, tuple) else [_table]:
        if isinstance(_fault, Fault) and _fault.name not in CATALOGUE:
            CATALOGUE[_fault.name] = _fault
        else:
            leave_out(_package, str(getattr(_fault, "name", _fault)), "it is no `Fault`, or there is one already")
"""Every fault, from the hand to the host, then those of other packages, whose entry points of the group
`aero_hil.faults` name tuples of `Fault`."""
TEXT = re.compile(r"(?P<name>[^:=@]+)(:(?P<channel>[^:=@]+))?(=(?P<severity>[^:=@]+))?(@(?P<at>[^:=@]+))?")


def parse_fault(text: str) -> Injection:
    """Parse an injection written as `NAME[:CHANNEL][=SEVERITY][@SECONDS]`.

    A severity is a number in the unit of the catalogue, or `mild`, `medium` (the default) or `severe`. The default
    channel is the first of `Fault.channels`.

    Raises:
        ValueError: unknown fault, channel, severity or time; the line names the valid ones.
    """
    match = TEXT.fullmatch(text.strip())
    if match is None:
        raise ValueError(f"a fault is written NAME[:CHANNEL][=SEVERITY][@SECONDS], not {text!r}")
    fault = named("fault", match["name"], CATALOGUE, "`aero-hil faults` lists them")
    severity = None if match["severity"] is None else _severity(fault, match["severity"])
    at_s = None if match["at"] is None else _number(match["at"], "a time in seconds")
    return fault.at(severity, None if match["channel"] is None else channel_named(match["channel"]), at_s)


def named(what: str, name: str, known: Mapping[str, Known], listed: str = "") -> Known:
    """Return the entry of `known` with a name.

    Raises:
        ValueError: unknown name; the line suggests a close one and names the valid ones.
    """
    if name not in known:
        raise ValueError(f"unknown {what} {name!r}; {meant(name, known)}{listed or 'choose from ' + ', '.join(known)}")
    return known[name]


def channel_named(label: str) -> Channel:
    """Return the channel with a label; raises ValueError as `named` does."""
    return named("channel", label, {channel.label: channel for channel in Channel})


def _severity(fault: Fault, text: str) -> float:
    if text in STEPS:
        return 1.0 if fault.severity is None else fault.severity.steps[STEPS.index(text)]
    return _number(text, "a severity: a number, mild, medium or severe")


def _number(text: str, what: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{text!r} is not {what}") from None


PLACES: dict[tuple[Channel, ...], str] = {(): "the hand", ALL: "a channel", CABLES: "a cable", FINGERS: "a finger"}


def severities(fault: Fault) -> str:
    """Return the mild, medium and severe severity with their unit, as text for display."""
    return "no severity" if fault.severity is None else str(fault.severity)


def where(fault: Fault) -> str:
    """Return the candidate channels of a fault, as text for display."""
    return PLACES.get(fault.channels) or ", ".join(channel.label for channel in fault.channels)


def begins(fault: Fault) -> str:
    """Return the start time of a fault, as text for display."""
    return "built in" if not fault.later else f"@{fault.at_s:g}" if fault.at_s else "any time"
