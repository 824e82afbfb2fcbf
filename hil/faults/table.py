"""The catalogue as a table in Markdown, for docs/faults.md and for people."""

from __future__ import annotations

from aero.channels import CABLES, FINGERS, Channel
from hil.faults.catalogue import CATALOGUE
from hil.faults.fault import ALL, Kind

HEADER = "| fault | what it is | severity: mild, medium, severe | where | list | layer | begins |"
PLACES: dict[tuple[Channel, ...], str] = {(): "the hand", ALL: "a channel", CABLES: "a cable", FINGERS: "a finger"}


def markdown() -> str:
    """Return one row a fault."""
    rows = [HEADER, "|---|---|---|---|---|---|---|", *map(_row, CATALOGUE.values())]
    return "\n".join(rows)


def _row(kind: Kind) -> str:
    severity = "there or not" if kind.is_switch else f"{', '.join(f'{s:g}' for s in kind.severities)} {kind.unit}"
    where = PLACES.get(kind.subjects) or ", ".join(channel.label for channel in kind.subjects)
    begins = "built in" if not kind.later else f"@{kind.at_s:g}" if kind.at_s else "any time"
    meaning = kind.meaning if kind.visible else f"{kind.meaning} (cannot be seen: {kind.reason})"
    return f"| `{kind.name}` | {meaning} | {severity} | {where} | {' '.join(kind.ids)} | {kind.layer} | {begins} |"
