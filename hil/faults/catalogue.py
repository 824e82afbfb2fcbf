"""All faults, by name, and the text that stands for one."""

from __future__ import annotations

import re
from difflib import get_close_matches

from aero.channels import CABLES, FINGERS, Channel
from hil.faults import answers, board, encoder, host, link, mechanics, motor, servo, supply
from hil.faults.fault import ALL, Fault, Kind

FAULT_FILES = (mechanics, supply, motor, encoder, servo, answers, board, link, host)
CATALOGUE: dict[str, Kind] = {kind.name: kind for file in FAULT_FILES for kind in file.KINDS}
"""Every kind of fault, from the hand to the host."""
WORDS = ("mild", "medium", "severe")
"""What may stand for a severity."""
TEXT = re.compile(r"(?P<name>[^:=@]+)(:(?P<channel>[^:=@]+))?(=(?P<severity>[^:=@]+))?(@(?P<at>[^:=@]+))?")


def parse_fault(text: str) -> Fault:
    """Return the fault that `NAME[:CHANNEL][=SEVERITY][@SECONDS]` stands for.

    A severity is a number in the unit of the catalogue, or `mild`, `medium` (when left out) or `severe`. Without a
    channel the fault sits on the first of its kind's.

    Raises:
        ValueError: no such fault, channel, severity or time; one line says what there is.
    """
    match = TEXT.fullmatch(text.strip())
    if match is None:
        raise ValueError(f"a fault is written NAME[:CHANNEL][=SEVERITY][@SECONDS], not {text!r}")
    kind = _kind(match["name"])
    severity = None if match["severity"] is None else _severity(kind, match["severity"])
    at_s = None if match["at"] is None else _number(match["at"], "a time in seconds")
    return kind.fault(severity, None if match["channel"] is None else _channel(match["channel"]), at_s)


def checked(fault: Fault) -> Fault:
    """Return a fault with its channel filled in.

    Raises:
        ValueError: there is no such fault, or it is impossible.
    """
    return _kind(fault.name).checked(fault)


def _kind(name: str) -> Kind:
    if name not in CATALOGUE:
        close = get_close_matches(name, CATALOGUE, 1)
        meant = f"did you mean {close[0]}? " if close else ""
        raise ValueError(f"there is no fault {name!r}; {meant}`aero-hil faults` lists them")
    return CATALOGUE[name]


def _channel(label: str) -> Channel:
    found = {channel.label: channel for channel in Channel}
    if label not in found:
        raise ValueError(f"there is no channel {label!r}; there are {', '.join(found)}")
    return found[label]


def _severity(kind: Kind, text: str) -> float:
    return (
        kind.severities[WORDS.index(text)]
        if text in WORDS
        else _number(text, "a severity: a number, mild, medium or severe")
    )


def _number(text: str, what: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{text!r} is not {what}") from None


PLACES: dict[tuple[Channel, ...], str] = {(): "the hand", ALL: "a channel", CABLES: "a cable", FINGERS: "a finger"}


def severities(kind: Kind) -> str:
    """Return the mild, medium and severe severity with their unit, for people."""
    return "there or not" if kind.is_switch else f"{', '.join(f'{s:g}' for s in kind.severities)} {kind.unit}"


def where(kind: Kind) -> str:
    """Return where a fault may sit, for people."""
    return PLACES.get(kind.subjects) or ", ".join(channel.label for channel in kind.subjects)


def begins(kind: Kind) -> str:
    """Return when a fault begins, for people."""
    return "built in" if not kind.later else f"@{kind.at_s:g}" if kind.at_s else "any time"
