"""The fault dictionary: what each known fault does to the readings, learned from a campaign, as small data."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Any

from aero.channels import Channel
from hil.faults import CATALOGUE, Fault, parse_fault
from hil.verdict.signature import Signature

FILE, DRAWN = "dictionary.json", "drawn.json"
"""Every fault of the catalogue in three severities on one channel; and faults drawn at random."""
LEAST = 0.3
"""Feature below which it is left out of the file; at twice that, causes begin to be confused."""


@dataclass(frozen=True)
class Entry:
    """One fault on one hand of the campaign."""

    cause: str
    """What a finding names: see `Kind.cause`."""
    fault: Fault
    features: Signature

    @property
    def seats(self) -> tuple[Channel | None, ...]:
        """Channels that it may sit on as well, None for the whole hand: what it does to one it does to all."""
        return CATALOGUE[self.fault.name].subjects or (None,)


def load_dictionary(*files: str) -> tuple[Entry, ...]:
    """Return what ships: the entries of some of its files, of both when none is given."""
    data = resources.files("hil") / "data"
    return tuple(
        _entry(table)
        for file in files or (FILE, DRAWN)
        for table in json.loads((data / file).read_text(encoding="utf-8"))["entries"]
    )


def dictionary_text(entries: Iterable[Entry], provenance: Mapping[str, str | int | list[str]]) -> str:
    """Return a dictionary as JSON, an entry a line."""
    lines = [json.dumps({"fault": str(e.fault), "cause": e.cause, **_rounded(e.features)}) for e in entries]
    head = json.dumps({"provenance": provenance})[:-1]
    return f'{head}, "entries": [\n' + ",\n".join(lines) + "\n]}\n"


def _entry(table: dict[str, Any]) -> Entry:
    return Entry(table.pop("cause"), parse_fault(table.pop("fault")), table)


def rounded(entry: Entry) -> Entry:
    """Return an entry as its file keeps it."""
    return Entry(entry.cause, entry.fault, _rounded(entry.features))


def _rounded(features: Signature) -> dict[str, float]:
    return {name: round(value, 1) for name, value in sorted(features.items()) if abs(value) >= LEAST}
