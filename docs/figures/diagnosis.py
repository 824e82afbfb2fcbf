"""Cases that a played owner goes through to their end: which part they convict, in how many steps and minutes."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from random import Random
from statistics import median
from typing import NamedTuple

import click
from owner import is_right, play

from aero.side import Side
from figures.inputs import ROOT
from figures.results import Rows
from figures.strangers import drawn_physics
from hil.emulated.faults import CATALOGUE
from hil.emulated.faults.fault import Fault, Injection
from hil.recordings.provenance import source_commit
from train.workers import usable_cores, worker_processes

DRAWN, PHYSICS, HEALTHY = 30, 100, 6
DECLARED = ("0.2.0", "0.1.5")
"""Firmware of the hands; a board that runs it has no fault."""
SIDES: tuple[Side, ...] = ("right", "left")
HEADER = [
    "set",
    "found",
    "part right",
    "or one that looks alike",
    "good part convicted",
    "open",
    "gone on a broken hand",
    "steps",
    "minutes",
]


class PlayedSet(NamedTuple):
    """A row of the table."""

    name: str
    first_seed: int
    """Seed of the first hand; each case has a hand of its own."""
    faults: Sequence[Sequence[Injection]]


def drawn(seed: int) -> list[tuple[Injection]]:
    """Return faults of the catalogue, of medium or large severity, drawn by a seed."""
    random = Random(seed)
    kinds = [fault for name, fault in CATALOGUE.items() if name.removeprefix("board_runs_") not in DECLARED]

    def one(fault: Fault) -> Injection:
        channel = random.choice(fault.channels) if fault.channels else None
        return fault.at(random.choice(fault.steps()[1:] or fault.steps()), channel)

    return [(one(fault),) for fault in random.sample(kinds, DRAWN)]


def physics(seed: int) -> list[tuple[Injection]]:
    """Return faults outside the catalogue, drawn as parameters that are off, from consecutive seeds."""
    return [(drawn_physics(seed + number),) for number in range(PHYSICS)]


ALL = (
    PlayedSet("drawn faults of the catalogue, unseen", 484_000, drawn(484_000)),
    PlayedSet("physics drawn, for work", 900_000, physics(900_000)),
    PlayedSet("physics drawn, not looked at", 910_000, physics(910_000)),
    PlayedSet("no fault", 474_000, [()] * HEALTHY),
)


@dataclass(frozen=True)
class CaseEnd:
    """End of a case, as a row counts it."""

    faults: str
    found: bool
    """Whether the validation failed."""
    right: bool
    """Whether a convicted part is that of a fault."""
    alike: bool
    """Whether each convicted part is that of a fault, or one that looks alike."""
    convicted: str
    """Empty for none."""
    mended_broken: bool
    """Whether a hand that still has its fault was said to be mended."""
    steps: tuple[str, ...]
    minutes: float
    """Time of the owner."""
    ended: str
    """Error that ended the case; empty for none."""
    cpu_s: float


def played(row: int, number: int) -> CaseEnd:
    """Play one case of a set."""
    faults, seed = ALL[row].faults[number], ALL[row].first_seed + number
    one = play(faults, f"plausible:{seed}", seed, DECLARED[number % 2], SIDES[number // 2 % 2])
    return CaseEnd(
        " ".join(map(str, faults)),
        one.found,
        any(is_right(suspect, fault) for suspect in one.told for fault in faults),
        all(any(is_right(suspect, fault, alike=True) for fault in faults) for suspect in one.told),
        ", ".join(map(str, one.told)),
        one.mended and one.broken,
        () if one.case is None else tuple(done.proposal.step.name for done in one.case.done),
        one.minutes,
        one.ended,
        one.cpu_s,
    )


def _played(at: tuple[int, int]) -> tuple[int, int, CaseEnd]:
    return *at, played(*at)


class Ends:
    """Ends of cases in a file, to which each is added when it is known; a tree without changes goes on with it."""

    def __init__(self, commit: str) -> None:
        """Read what an interrupted run of the same commit has left."""
        self.path = ROOT / "build" / f"cases-{commit or 'unknown'}.jsonl"
        self.path.parent.mkdir(exist_ok=True)
        if "+" in commit or not commit:
            self.path.unlink(missing_ok=True)
        self.known = {(row, number): _end_of(fields) for row, number, fields in _lines(self.path)}

    def add(self, row: int, number: int, end: CaseEnd) -> None:
        """Store the end of a case."""
        self.known[row, number] = end
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps([row, number, asdict(end)]) + "\n")


def _lines(path: Path) -> list[tuple[int, int, dict[str, object]]]:
    return [json.loads(line) for line in path.read_text("utf-8").splitlines()] if path.exists() else []


def _end_of(fields: dict[str, object]) -> CaseEnd:
    return CaseEnd(**fields)  # type: ignore[arg-type]


def cases(most: int | None = None) -> Rows:
    """Return the ends of whole cases, played on guarded hands that are opened anew for each step.

    Args:
        most: cases of each set; None for all.
    """
    ends = Ends(source_commit())
    left = [
        (row, number)
        for row, one in enumerate(ALL)
        for number in range(len(one.faults))[:most]
        if (row, number) not in ends.known
    ]
    with worker_processes(usable_cores()) as pool:
        for count, (row, number, end) in enumerate(pool.map(_played, left), start=1):
            ends.add(row, number, end)
            said = end.convicted or end.ended or ("nobody" if end.found else "not found")
            click.echo(f"{count} of {len(left)}, {end.faults or 'no fault'}: {said} ({end.cpu_s:.0f} s)", err=True)
    return [
        HEADER,
        *(
            row_of(one.name, [ends.known[row, number] for number in range(len(one.faults))[:most]])
            for row, one in enumerate(ALL)
        ),
    ]


def row_of(name: str, ends: Sequence[CaseEnd]) -> list[str]:
    """Return the row of a set."""
    found = [one for one in ends if one.found]
    convicted, of = [one for one in found if one.convicted], f"of {len(found)}"
    alike, steps = sum(one.alike for one in convicted), [len(one.steps) for one in found] or [0]
    return [
        name,
        f"{len(found)} of {len(ends)}",
        f"{sum(one.right for one in convicted)} {of}",
        f"{alike} {of}",
        f"{len(convicted) - alike} {of}",
        f"{len(found) - len(convicted)} {of}",
        f"{sum(one.mended_broken for one in found)} {of}",
        f"{median(steps):g}, at most {max(steps)}",
        f"{median([one.minutes for one in found] or [0]):g}",
    ]


def two_cases() -> Rows:
    """Return the ends of a drawn fault's case and of a healthy hand's."""
    found = [played(row, 0) for row in (0, len(ALL) - 1)]
    return [
        ["faults", "found", "convicted", "steps"],
        *([one.faults, str(one.found), one.convicted, ", ".join(one.steps)] for one in found),
    ]


TABLES = (cases,)
SAMPLES = {cases: two_cases}
