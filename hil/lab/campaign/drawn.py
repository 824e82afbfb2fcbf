"""Faulty hands that are drawn at random: which fault, where, how severe, since when, and in which hand."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from hil.faults import CATALOGUE
from hil.faults.board import RUNS
from hil.faults.fault import HOMED, Fault, Kind
from hil.lab.campaign.plan import USUAL_FIRMWARE, healthy_hands
from hil.lab.campaign.trial import Trial

MILDEST = 0.3
"""Part of the way from mild to severe, in the logarithm, below which no severity is drawn: few of those are found."""
LATER = 0.3
"""Share of the faults that begin while the hand is validated, where they can."""
LATEST_S = 60.0
"""Latest beginning, s."""


def drawable() -> tuple[Kind, ...]:
    """Return the kinds that a validation can see at some severity."""
    return tuple(kind for kind in CATALOGUE.values() if kind.visible and kind.reason != HOMED)


def drawn_hands(first: int, count: int, firmware: Sequence[str] = USUAL_FIRMWARE) -> list[Trial]:
    """Return trials of hands with one fault each, with seeds from `first` on.

    Every cause of the catalogue comes once before any comes again. The same seeds give the same trials, so that a
    campaign may be made longer.
    """
    kinds = _in_rounds(drawable(), np.random.default_rng(first))
    return [
        replace(hand, faults=(str(draw(next(kinds), hand.firmware, np.random.default_rng(hand.seed))),))
        for hand in healthy_hands(first, count, firmware)
    ]


def draw(kind: Kind, declared: str, random: np.random.Generator) -> Fault:
    """Return a fault of a kind with a channel, a severity and a beginning drawn at random.

    Args:
        kind: of the catalogue.
        declared: version that the board is declared to run.
        random: the source.
    """
    if kind.name == f"{RUNS}{declared}":  # no fault; any other version is as good
        others = [other for other in drawable() if other.cause == kind.cause and other.name != kind.name]
        kind = others[0] if others else CATALOGUE["board_of_other_side"]
    channel = kind.subjects[int(random.integers(len(kind.subjects)))] if kind.subjects else None
    begins, seconds = random.random(), round(float(random.uniform(2.0, LATEST_S)), 1)
    later = kind.later and (kind.at_s > 0.0 or begins < LATER)
    return kind.fault(_severity(kind, float(random.uniform(MILDEST, 1.0))), channel, seconds if later else 0.0)


def _severity(kind: Kind, part: float) -> float:
    mild, _, severe = kind.severities
    return float(f"{math.exp((1.0 - part) * math.log(mild) + part * math.log(severe)):.3g}")


def _in_rounds(kinds: Sequence[Kind], random: np.random.Generator) -> Iterator[Kind]:
    causes: dict[str, list[Kind]] = defaultdict(list)
    for kind in kinds:
        causes[kind.cause].append(kind)
    while True:
        for cause in random.permutation(sorted(causes)):
            alike = causes[str(cause)]
            yield alike[int(random.integers(len(alike)))]
