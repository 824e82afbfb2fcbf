"""Tables of docs/commands.md: emulated hands that wear over twenty weekly runs, and the runs at which that is reported.

`python -m figures.commands` in the environment of `tox -e figures` measures and stores them, in about ten minutes of
two cores.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from multiprocessing import get_context
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from unittest.mock import patch

from aero.channels import CABLES, Channel
from figures import Rows, store
from hil import open_target
from hil.faults import CATALOGUE
from hil.faults.fault import Injection
from hil.history.drift import drifts_of, tracks_of
from hil.history.runs import of_hand, runs_in
from hil.recordings.provenance import source_commit
from hil.report.results import write_figures
from hil.verdict.validation import validate
from model.units.conditions import drawn

EXPERIMENTS = ("presence", "audit", "holding")
"""Quickest default experiments in which the currents against springs and motors are measured."""
OF_CABLES = ("presence", "staircase")
"""Experiments on a stretched cable, whose take-up only the staircase measures."""
DAYS = ("temperature", "tension")
"""Conditions that differ between the days of one hand on one bench."""
RUNS, EVERY = 20, timedelta(days=7)
BEGIN = datetime(2026, 1, 5, 9, tzinfo=UTC)
HANDS, HEALTHY, FIRST_SEED, WORKERS = 3, 10, 490_000, 2


@dataclass(frozen=True)
class WornHand:
    """Hand whose fault grows from zero at the first run to its least severity of the catalogue at the last."""

    name: str
    seed: int
    fault: str = ""
    """Name in the catalogue; empty for a hand without wear."""
    channel: Channel = Channel.INDEX

    def injected(self, run: int) -> tuple[Injection, ...]:
        """Return the faults at a run, 0 to `RUNS` - 1."""
        if not self.fault or not run:
            return ()
        fault = CATALOGUE[self.fault]
        return (fault.at(fault.steps()[0] * run / (RUNS - 1), self.channel),)


@dataclass(frozen=True)
class Told:
    """Runs, counted from 1, of the first report of a drift and of the first failed check; None for never."""

    drift: int | None
    failed: int | None
    sentence: str = ""

    @property
    def in_time(self) -> bool:
        """Whether the drift was reported at a run before the first that failed."""
        return self.drift is not None and (self.failed is None or self.drift < self.failed)


def hands(name: str, fault: str, first: int, count: int) -> list[WornHand]:
    """Return hands of one kind of wear, the channels with cables in turn."""
    return [WornHand(f"{name} {i}", first + i, fault, CABLES[i % len(CABLES)]) for i in range(count)]


KINDS = {
    "springs that tire": hands("springs", "spring_off", FIRST_SEED, HANDS),
    "a cable that stretches": hands("cable", "cable_long", FIRST_SEED + 100, HANDS),
    "a motor that fades": hands("motor", "motor_weak", FIRST_SEED + 200, HANDS),
    "none": hands("healthy", "", FIRST_SEED + 300, HEALTHY),
}


def lived(hand: WornHand) -> Told:
    """Validate a hand once a week and read its history after each run."""
    with TemporaryDirectory() as place:
        for run in range(RUNS):
            folder = Path(place, f"{run:02}")
            folder.mkdir()
            _run(hand, run, folder)
        runs = of_hand(runs_in([Path(place)])[0], hand.name)
    told, sentence = None, ""
    for count in range(1, RUNS + 1):
        drifts = drifts_of(tracks_of(runs[:count]))
        ours = [one for one in drifts if not hand.fault or one.track.subject == hand.channel.label]
        if ours:
            told, sentence = count, ours[0].sentence
            break
    failed = next((place for place, one in enumerate(runs, start=1) if not one.passed), None)
    return Told(told, failed, sentence)


def _run(hand: WornHand, run: int, folder: Path) -> None:
    date = BEGIN + run * EVERY
    seed = hand.seed * RUNS + run
    opening = open_target(
        unit=f"plausible:{hand.seed}", seed=seed, hand_id=hand.name, homed=True, faults=hand.injected(run),
        conditions=drawn(seed, DAYS),
    )  # fmt: skip
    with patch("hil.recordings.recorder.local_time", lambda _ago_s: date.isoformat()), opening as target:
        write_figures(validate(target, OF_CABLES if hand.fault == "cable_long" else EXPERIMENTS, folder=folder), folder)


def wear() -> Rows:
    """Hands of each kind of wear whose drift is reported before a check fails."""
    rows = [["wear", "drift reported before a check fails", "reported at run", "a check failed", "at run"]]
    with ProcessPoolExecutor(WORKERS, get_context("fork")) as pool:
        for name, some in KINDS.items():
            rows.append(row(name, list(pool.map(lived, some))))
            print(rows[-1], file=sys.stderr, flush=True)
    return rows


def row(name: str, found: Sequence[Told]) -> list[str]:
    """Return the row of a kind."""
    told = [one.drift for one in found if one.drift is not None]
    failed = [one.failed for one in found if one.failed is not None]
    in_time = sum(one.in_time for one in found)
    return [
        name,
        f"{in_time} of {len(found)}",
        f"{median(told):g}" if told else "-",
        f"{len(failed)} of {len(found)}",
        f"{median(failed):g}" if failed else "-",
    ]


if __name__ == "__main__":
    store("commands.wear", wear(), origin=f"commit {source_commit()[:7]}")
