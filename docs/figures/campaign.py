"""Tables of docs/results/campaign.md: fresh healthy hands and drawn faults; each run is stored at once."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Sequence
from functools import cache, partial
from random import Random

from driver_mistakes import GENTLE, MAPPED, MISTAKES, MISTAKES_OF_THE_MAP, named_driver
from rich.console import Console

from figures.inputs import ROOT
from figures.results import Rows
from hil.emulated.faults import CATALOGUE, parse_fault
from hil.recordings.provenance import source_commit
from train.campaign.store import opened
from train.campaign.summary import NOT_FIRED, false_alarms, flagged, right_part, told
from train.campaign.trial import USUAL_FIRMWARE, Outcome, Trial, faulty_hands, healthy_hands, perform
from train.cli.campaign import run_trials
from train.share import Share
from train.workers import usable_cores, worker_processes

OLD_FIRMWARE = ("pre", "0.1.1", "0.1.2")
HEALTHY = ((USUAL_FIRMWARE, 360_000, 48), (OLD_FIRMWARE, 360_100, 24))
"""Firmware, first seed and number of healthy hands."""
DRAWN, FIRST_FAULTY = 44, 382_000
"""Number of drawn faults; seed of the draw and of the first hand."""
HEADER = ["", "figure", "95 %"]


def drawn_faults() -> list[str]:
    """Return faults of the catalogue, each once at most, of a drawn channel and of medium or severe severity."""
    random = Random(FIRST_FAULTY)
    kinds = random.sample(list(CATALOGUE.values()), DRAWN)
    return [
        str(kind.at(random.choice(kind.steps()[1:] or kind.steps()), random.choice(kind.channels or (None,))))
        for kind in kinds
    ]


def trials() -> list[Trial]:
    """Return every run of the campaign."""
    healthy = [hand for firmware, first, count in HEALTHY for hand in healthy_hands(first, count, firmware)]
    return healthy + faulty_hands(drawn_faults(), FIRST_FAULTY, hands=1)


@cache
def outcomes() -> Sequence[Outcome]:
    """Run the campaign, or the rest of one that this commit has begun in `build`."""
    commit = source_commit() or "+unknown"
    folder = ROOT / "build" / f"campaign-{commit}"
    if "+" in commit:
        shutil.rmtree(folder, ignore_errors=True)
    with opened(folder) as store:
        workers = partial(worker_processes, usable_cores())
        run_trials(Console(stderr=True), trials(), store, workers, folder)
        return list(store.outcomes())


def verdict() -> Rows:
    """What is found of the faults, and whether the part at fault is suspected; each mistake of the driver."""
    return verdict_of(outcomes())


def alarms() -> Rows:
    """Healthy hands that are flagged, by firmware and by their initial conditions."""
    return alarms_of(outcomes())


def verdict_of(outcomes: Sequence[Outcome]) -> Rows:
    """Return the rows of `verdict`."""
    faulty = [one for one in outcomes if len(one.trial.faults) == 1 and one.ended != NOT_FIRED]
    faults = {one.trial.key: parse_fault(one.trial.faults[0]) for one in faulty}
    found = [right_part(faults[one.trial.key], told(one)) for one in faulty if flagged(one)]
    alarms, _ = false_alarms(outcomes)
    rows = [
        HEADER,
        _row("healthy hands flagged", alarms),
        _row("faults found", Share(len(found), len(faulty))),
        _row("part at fault suspected first, of those found", _share(found)),
    ]
    mistakes = [(one, GENTLE) for one in MISTAKES.values()] + [(one, MAPPED) for one in MISTAKES_OF_THE_MAP.values()]
    named = _share(named_driver(one, experiments) for one, experiments in mistakes)
    return [*rows, _row("mistakes of the driver or its map, named so", named)]


def alarms_of(outcomes: Sequence[Outcome]) -> Rows:
    """Return the rows of `alarms`."""
    rows = [["firmware", "conditions", "flagged", "95 %", "for"]]
    for firmware, _, _ in HEALTHY:
        for name, under in (("none", False), ("all kinds at once", True)):
            share, checks = false_alarms(
                [one for one in outcomes if one.trial.firmware in firmware and bool(one.trial.conditions) is under]
            )
            rows.append([", ".join(firmware), name, *_cells(share), ", ".join(checks) or "-"])
    return rows


def _share(right: Iterable[bool]) -> Share:
    told_right = list(right)
    return Share(sum(told_right), len(told_right))


def _row(name: str, share: Share) -> list[str]:
    return [name, *_cells(share)]


def _cells(share: Share) -> list[str]:
    if not share.of:
        return ["-", "-"]
    low, high = share.interval
    return [f"{share.count} of {share.of}", f"{100 * low:.1f} % to {100 * high:.1f} %"]


def three_hands() -> Rows:
    """Return the outcomes of a healthy hand and of the first two faults."""
    count = sum(hands for _, _, hands in HEALTHY)
    found = map(perform, (trials()[0], *trials()[count : count + 2]))
    rows = [[one.trial.key, ", ".join(one.failed), ", ".join(one.suspects), one.ended] for one in found]
    return [["hand", "failed", "suspects", "ended"], *rows]


TABLES = (verdict, alarms)
SAMPLES = dict.fromkeys(TABLES, three_hands)
