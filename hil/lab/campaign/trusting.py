"""How far a dictionary can be trusted, from what its own hands say when each is held out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from hil.faults import parse_fault
from hil.lab.campaign.learning import cause_of, entries, judged, seen, telling
from hil.lab.campaign.placing import Floats, fit_places, usual_readings
from hil.lab.campaign.trial import Outcome
from hil.verdict.causes import CAUSES
from hil.verdict.deviation import deviation
from hil.verdict.dictionary import Entry, rounded
from hil.verdict.explanation import Place
from hil.verdict.likeness import Known, Likeness
from hil.verdict.reference import Reference, Trust, best_seats, cause_shares
from hil.verdict.whereabouts import Placing

SHARPEST, DULLEST = 0.02, 0.5
"""Bounds of `Trust.sharpness`."""
RIDGE = 0.05
"""Penalty of the slope of `Trust.believed`, so that few hands cannot make it a step."""


def learn(outcomes: Sequence[Outcome], before: Sequence[Entry] = ()) -> Reference:
    """Return what the faulty hands of a campaign teach.

    Every hand is held out in turn to learn how far the rest can be trusted about it: its own cause without the hand
    stands for what is known, the other causes for what a kind would find that nobody has seen.

    Raises:
        ValueError: no hand is accused, or no cause has two.
    """
    hands = telling(outcomes)
    if not hands:
        raise ValueError("nothing to learn from: no hand with a single fault is accused")
    found = [seen(hand) for hand in hands]
    usual = usual_readings(found)
    runs = [deviation(one, usual, judged(hand)) for one, hand in zip(found, hands, strict=True)]
    causes = [cause_of(parse_fault(hand.trial.faults[0])) for hand in hands]
    placing = Placing(usual, fit_places(runs, [CAUSES[cause][0] for cause in causes]))
    known = Known([*(rounded(entry) for entry in entries(hands)), *before], usual)
    held_out = [best_seats(known.explained(run, leaving_out=index)) for index, run in enumerate(runs)]
    return Reference(known, placing, trust(held_out, causes, [placing.shares(run) for run in runs]))


def trust(
    held_out: Sequence[Sequence[Likeness]], causes: Sequence[str], places: Sequence[Mapping[Place, float]]
) -> Trust:
    """Return how far likenesses can be trusted.

    Args:
        held_out: of each hand, by what was learned from the others.
        causes: the right one of each.
        places: how likely each place is, by what all hands taught.

    Raises:
        ValueError: of no hand the cause was learned from another.
    """
    others = np.array(
        [
            max((one.explained for one in likely if one.cause != cause), default=0.0)
            for likely, cause in zip(held_out, causes, strict=True)
        ]
    )
    twins = [i for i, likely in enumerate(held_out) if any(one.cause == causes[i] for one in likely)]
    if not twins:
        raise ValueError("nothing to trust: every cause has a single hand; draw more of them")
    sharpness = _sharpness([held_out[i] for i in twins], [causes[i] for i in twins])
    right = [cause_shares(held_out[i], places[i], sharpness)[causes[i]] for i in twins]
    best = np.array([max(one.explained for one in held_out[i]) for i in twins])
    return Trust(tuple(sorted(round(share, 4) for share in right)), sharpness, _believed(best, others))


def _sharpness(held_out: Sequence[Sequence[Likeness]], causes: Sequence[str]) -> float:
    """Return the sharpness under which the right causes are likeliest among those of their place."""
    rows = []
    for likely, cause in zip(held_out, causes, strict=True):
        rivals: dict[str, float] = {}
        for one in likely:
            if CAUSES[one.cause][0] is CAUSES[cause][0]:
                rivals.setdefault(one.cause, one.explained)
        rows.append((rivals[cause], np.array(list(rivals.values()))))

    def loss(sharpness: float) -> float:
        return float(sum(np.log(np.exp((rivals - own) / sharpness).sum()) for own, rivals in rows))

    return round(float(minimize_scalar(loss, bounds=(SHARPEST, DULLEST), method="bounded").x), 3)


def _believed(known: Floats, unknown: Floats) -> tuple[float, float]:
    """Return slope and constant of the share of known ones at what the best cause explains, both equally likely."""

    def loss(line: Floats) -> float:
        slope, constant = line
        missed = (
            np.log1p(np.exp(-(slope * known + constant))).mean() + np.log1p(np.exp(slope * unknown + constant)).mean()
        )
        return float(missed + RIDGE / len(known) * slope**2)

    slope, constant = minimize(loss, np.zeros(2)).x
    return round(float(slope), 3), round(float(constant), 3)
