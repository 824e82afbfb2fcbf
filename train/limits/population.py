"""Population behind the limits: drawn hands, their readings, and cross-validated false alarms.

All kinds of healthy hands have equal weight: both sides, with and without guard, with and without conditions, every
firmware. Each hand is homed before the validation, as the instructions for owners require.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from aero.firmware import VERSION_GROUPS
from hil.checks import BOUNDS
from hil.verdict.limits import excesses, within_limits
from train.campaign.trial import SIDES, USUAL_FIRMWARE, Outcome, Trial, healthy_hands
from train.limits.compute import Healthy, Readings, computed_limits

GENERATOR = "model/units/plausible.py and model/units/conditions.py"
USUAL = (400_000, 320)
"""First seed and number of hands with usual firmware; the whole population takes 40 min on two cores."""
_OTHERWISE = (versions[-1] for versions in VERSION_GROUPS if not set(versions) & set(USUAL_FIRMWARE))
RARE = tuple((401_000 + 1_000 * number, version) for number, version in enumerate(_OTHERWISE))
"""First seed of the hands with each firmware that moves differently from the usual ones."""
RARE_HANDS = 80
SHORT, SHORT_HANDS = 404_000, 120
"""First seed and number of hands for the short staircase only, which is not part of a default run."""
FOLDS = 5
"""Folds of the cross-validation, each judged by limits from the others.

Five is coprime to the number of kinds that alternate, so each fold contains all of them.
"""


def drawn() -> list[Trial]:
    """Return the trials of the population, ordered so that any prefix is a fair sample."""
    hands = partial(healthy_hands, sides=SIDES[::-1])
    usual, rare = hands(*USUAL), [hands(first, RARE_HANDS, (named,)) for first, named in RARE]
    share = len(usual) // RARE_HANDS
    mixed = [
        trial
        for place in range(RARE_HANDS)
        for trial in (*usual[share * place : share * (place + 1)], *(some[place] for some in rare))
    ]
    every = (*USUAL_FIRMWARE, *(named for _, named in RARE))
    short = [replace(trial, experiments=("short_staircase",)) for trial in hands(SHORT, SHORT_HANDS, every)]
    return [*mixed, *short]


def healthy_hands_of(outcomes: Iterable[Outcome]) -> tuple[Healthy, ...]:
    """Return the readings of healthy hands by firmware group and guard; empty groups are omitted."""
    found: dict[tuple[bool, int], list[Outcome]] = defaultdict(list)
    for outcome in outcomes:
        group = next(i for i, versions in enumerate(VERSION_GROUPS) if outcome.trial.firmware in versions)
        found[outcome.trial.guarded, group].append(outcome)
    return tuple(
        Healthy(VERSION_GROUPS[group], _readings(hands), guarded=guarded)
        for (guarded, group), hands in sorted(found.items())
    )


def _readings(outcomes: Iterable[Outcome]) -> Readings:
    found: dict[tuple[str, str, str], list[float]] = defaultdict(list)
    for outcome in outcomes:
        for experiment, subjects in outcome.numbers.items():
            for subject, metrics in subjects.items():
                for metric, value in metrics.items():
                    found[experiment, metric, subject].append(value)
    return {key: np.array(values) for key, values in found.items()}


def held_out(outcomes: Sequence[Outcome]) -> tuple[int, int]:
    """Return the number of hands flagged by limits from the other folds, and the number judged.

    The shipped limits use all folds, so they flag somewhat fewer.
    """
    flagged = judged = 0
    for part in range(FOLDS):
        rest = [hand for place, hand in enumerate(outcomes) if place % FOLDS != part]
        limits = computed_limits(BOUNDS, healthy_hands_of(rest))
        for hand in outcomes[part::FOLDS]:
            trial = hand.trial
            own = [limit for limit in limits if limit.holds_for(trial.firmware, guarded=trial.guarded)]
            flagged += not all(map(within_limits, excesses(hand.numbers, own).values()))
            judged += 1
    return flagged, judged
