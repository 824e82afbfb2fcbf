"""What a campaign found of each fault, as a file: the source of docs/detection.md."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import groupby

from hil.lab.campaign.summary import Detection, Share

NAMED = 3
"""Checks that are named for a fault."""


@dataclass(frozen=True)
class Tried:
    """A fault in one severity, on several hands."""

    severity: float
    found: int
    of: int
    furthest: float
    """Of the hands that were missed, the largest part of the way from healthy readings to a limit, 0 to 1."""


@dataclass(frozen=True)
class DetectedFault:
    """What was found of one fault."""

    name: str
    tried: tuple[Tried, ...]
    """From mild to severe."""
    checks: tuple[str, ...]
    """That found it most often, `experiment/metric`, the most first."""

    @property
    def found_from(self) -> float | None:
        """The severity from which on the fault was found on every hand, None when there is none."""
        found = None
        for severity in reversed(self.tried):
            if severity.found < severity.of:
                break
            found = severity.severity
        return found


def by_fault(rows: Sequence[Detection]) -> tuple[DetectedFault, ...]:
    """Return what was found of each fault, from the rows of its severities."""
    return tuple(_fault(name, list(some)) for name, some in groupby(rows, key=lambda row: row.name))


def _fault(name: str, rows: Sequence[Detection]) -> DetectedFault:
    counts: Counter[str] = Counter()
    for row in rows:
        counts.update(dict(row.checks))
    ranked = sorted(counts.items(), key=lambda item: (-item[1], item[0]))
    tried = tuple(Tried(row.severity, row.found.count, row.found.of, round(row.furthest, 3)) for row in rows)
    return DetectedFault(name, tried, tuple(check for check, _ in ranked[:NAMED]))


def detected_text(
    faults: Sequence[DetectedFault], alarms: Share | None, provenance: Mapping[str, str | int | list[str]]
) -> str:
    """Return what was found as JSON.

    Args:
        faults: of `by_fault`.
        alarms: healthy hands that were accused, None when there were none.
        provenance: what it was found on.
    """
    accused = None if alarms is None else {"accused": alarms.count, "of": alarms.of}
    table = {"provenance": provenance, "healthy": accused, "faults": [asdict(fault) for fault in faults]}
    return json.dumps(table, indent=1) + "\n"


def parse_detected(text: str) -> tuple[tuple[DetectedFault, ...], Share | None]:
    """Return the faults and the healthy hands of a file that `detected_text` made.

    Raises:
        KeyError, TypeError, ValueError: it is no such file.
    """
    table = json.loads(text)
    faults = tuple(
        DetectedFault(row["name"], tuple(Tried(**tried) for tried in row["tried"]), tuple(row["checks"]))
        for row in table["faults"]
    )
    healthy = table["healthy"]
    return faults, None if healthy is None else Share(healthy["accused"], healthy["of"])
