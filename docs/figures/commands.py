"""Tables of docs/commands.md: emulated hands that wear over twenty weekly runs, and the runs at which that is reported.

The hands are validated into `build/wear`, in about 20 minutes of one core; after an interruption the rest is.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from unittest.mock import patch

from aero.channels import CABLES, Channel
from figures.inputs import ROOT
from figures.results import Rows
from hil.emulated.any_hand import open_target
from hil.emulated.faults import CATALOGUE
from hil.history.drift import Track, drifts_of, tracks_of
from hil.history.runs import of_hand, runs_in
from hil.report.results import write_figures
from hil.verdict.judged_run import Validation
from hil.verdict.validation import validate
from model.units.conditions import drawn

EXPERIMENTS = ("presence", "audit", "excursion", "response", "holding", "window")
"""Quick experiments on currents, stops, speed and cable length; the staircase takes twice as long as all of them."""
DAYS = ("temperature", "tension")
"""Conditions that differ between the days of one hand on one bench."""
RUNS, EVERY = 20, timedelta(days=7)
BEGIN = datetime(2026, 1, 5, 9, tzinfo=UTC)
HANDS, HEALTHY, FIRST_SEED, WORKERS = 4, 10, 620_000, 2


@dataclass(frozen=True)
class WornHand:
    """Hand whose fault grows linearly from zero at the first run to `severity` at the last."""

    name: str
    seed: int
    fault: str = ""
    """Name in the catalogue; empty for a hand without wear."""
    severity: float = 0.0
    channel: Channel = Channel.INDEX

    def wears(self, track: Track) -> bool:
        """Return whether a reading is of the worn channel or the whole hand; any is, of a hand without wear."""
        return not self.fault or track.subject in (self.channel.label, "hand")


@dataclass(frozen=True)
class Told:
    """Runs, counted from 1, of the first report of a drift and of the first limit passed; None for never."""

    drift: int | None
    failed: int | None
    sentence: str = ""

    @property
    def in_time(self) -> bool:
        """Whether the drift was reported at a run before the first beyond a limit."""
        return self.drift is not None and (self.failed is None or self.drift < self.failed)


def hands(kind: int, name: str, fault: str = "", severity: float = 0.0, count: int = HANDS) -> list[WornHand]:
    """Return hands of one kind of wear, the channels with cables in turn."""
    first = FIRST_SEED + 100 * kind
    return [WornHand(f"{name} {i}", first + i, fault, severity, CABLES[i % len(CABLES)]) for i in range(count)]


KINDS = {
    "springs that tire": hands(0, "springs", "spring_off", 0.6),
    "a cable that stretches": hands(1, "cable", "cable_long", 3.0),
    "a motor that fades": hands(2, "motor", "motor_weak", 0.4),
    "none": hands(3, "healthy", count=HEALTHY),
}
"""Severities of the catalogue next to the first that fails a check: of springs 0.7, of a cable 2 to 4 mm, of a motor
0.4 on hands outside this table."""


def lived(hand: WornHand, place: Path) -> Told:
    """Validate a hand once a week, except for runs below `place` already, and read its history after each run."""
    for run in range(RUNS):
        folder = place / hand.name / f"{run:02}"
        if not (folder / "checks.json").exists():
            folder.mkdir(parents=True, exist_ok=True)
            _run(hand, run, folder)
    runs, _ = of_hand(runs_in([place / hand.name])[0], hand.name)
    told, sentence = None, ""
    for count in range(1, RUNS + 1):
        if ours := [drift for drift in drifts_of(tracks_of(runs[:count])) if hand.wears(drift.track)]:
            told, sentence = count, ours[0].sentence
            break
    passed = [
        date
        for track in tracks_of(runs)
        if track.limit is not None and hand.wears(track)
        for date, value in zip(track.dates, track.values, strict=True)
        if not track.limit.at_least <= value <= track.limit.at_most
    ]
    return Told(told, (min(passed) - BEGIN) // EVERY + 1 if passed else None, sentence)


def _run(hand: WornHand, run: int, folder: Path) -> Validation:
    date = BEGIN + run * EVERY
    seed = hand.seed * RUNS + run
    opening = open_target(
        unit=f"plausible:{hand.seed}", seed=seed, hand_id=hand.name, homed=True, conditions=drawn(seed, DAYS)
    )
    with patch("hil.recordings.recorder.local_time", lambda _ago_s: date.isoformat()), opening as target:
        if hand.fault and run:
            # After the homing, which would compensate a cable's length: a board keeps its zeros for months.
            target.inject(CATALOGUE[hand.fault].at(hand.severity * run / (RUNS - 1), hand.channel))
        validation = validate(target, EXPERIMENTS, folder=folder)
        write_figures(validation, folder)
        return validation


def last_run() -> Rows:
    """Readings of the first hand at its last run."""
    with TemporaryDirectory() as folder:
        numbers = _run(KINDS["springs that tire"][0], RUNS - 1, Path(folder)).numbers
    subjects = (f"{name} {subject}" for name in numbers for subject in numbers[name])
    values = (one for of_one in numbers.values() for one in of_one.values())
    texts = (" ".join(f"{value:.5g}" for value in one.values()) for one in values)
    return [["subject", "readings"], *([name, text] for name, text in zip(subjects, texts, strict=True))]


def wear() -> Rows:
    """Hands of each kind of wear whose drift is reported before a limit is passed."""
    place = ROOT / "build" / "wear"
    rows = [["wear", "drift reported before a limit is passed", "reported at run", "a limit was passed", "at run"]]
    with ProcessPoolExecutor(WORKERS, get_context("fork")) as pool:
        for name, some in KINDS.items():
            found = list(pool.map(partial(lived, place=place), some))
            rows.append(row(name, found))
            print(rows[-1], *found, sep="\n", file=sys.stderr, flush=True)
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


TABLES = (wear,)
SAMPLES = {wear: last_run}
