"""Healthy hands of a campaign as limits are computed from them, and how well limits hold those they are not from."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Collection, Iterable, Sequence

import numpy as np

from aero.firmware import VERSION_GROUPS
from hil.checks import CHECKS
from hil.verdict.limits import excesses, within_limits
from model.units import DEFAULT_LIMITS, load_unit
from model.units.naming import PLAUSIBLE
from train.campaign.trial import Outcome
from train.limits.compute import LEAST_HANDS, Healthy, Readings, computed_limits


def healthy_hands_of(outcomes: Iterable[Outcome], kind: str = DEFAULT_LIMITS) -> tuple[Healthy, ...]:
    """Return the healthy hands of one kind by group of firmware; groups without any are left out.

    The population stands for the default kind; a shipped unit stands for the kind that it names.
    """
    population: dict[tuple[bool, int], list[Outcome]] = defaultdict(list)
    shipped: dict[tuple[bool, int], list[Outcome]] = defaultdict(list)
    for outcome in outcomes:
        trial = outcome.trial
        if trial.faults:
            continue
        group = next(i for i, versions in enumerate(VERSION_GROUPS) if trial.firmware in versions)
        if kind_of(trial.unit) == kind:
            hands = population if trial.unit.startswith(PLAUSIBLE) else shipped
            hands[trial.guarded, group].append(outcome)
    return tuple(
        Healthy(
            VERSION_GROUPS[group],
            _readings(population[guarded, group]),
            _readings(shipped[guarded, group]),
            guarded,
        )
        for guarded, group in sorted({*population, *shipped})
    )


def require_enough(outcomes: Iterable[Outcome]) -> None:
    """See that the population is large enough for limits.

    Raises:
        ValueError: it is not; the message says how many hands are needed.
    """
    enough = 8 * math.ceil(2 * LEAST_HANDS / 8)  # both guards and both kinds of condition take turns in eights
    kinds = [trial.guarded for outcome in outcomes if (trial := outcome.trial).unit.startswith(PLAUSIBLE)]
    free, guarded = kinds.count(False), kinds.count(True)
    if min(free, guarded) < LEAST_HANDS:
        raise ValueError(
            f"{free} healthy hands without a guard and {guarded} with one are too few for limits: {LEAST_HANDS} of "
            f"each are needed, so that the tail of a reading can be fitted; `aero-hil campaign --healthy {enough}` has "
            "them"
        )


def kind_of(unit: str) -> str:
    """Return the kind of hand that a unit stands for."""
    return DEFAULT_LIMITS if unit.startswith(PLAUSIBLE) else load_unit(unit).limits


def kinds_of(outcomes: Iterable[Outcome]) -> tuple[str, ...]:
    """Return the kinds whose healthy hands are in a campaign; the default kind needs hands of the population."""
    units = {outcome.trial.unit for outcome in outcomes if not outcome.trial.faults}
    population = any(unit.startswith(PLAUSIBLE) for unit in units)
    own = {kind_of(unit) for unit in units} - {DEFAULT_LIMITS}
    return (*((DEFAULT_LIMITS,) if population else ()), *sorted(own))


def _readings(outcomes: Iterable[Outcome]) -> Readings:
    found: dict[tuple[str, str, str], list[float]] = defaultdict(list)
    for outcome in outcomes:
        for experiment, subjects in outcome.numbers.items():
            for subject, metrics in subjects.items():
                for metric, value in metrics.items():
                    found[experiment, metric, subject].append(value)
    return {key: np.array(values) for key, values in found.items()}


FOLDS = 5
"""Parts of a campaign, each of which is judged by limits from the others."""


def held_out(outcomes: Sequence[Outcome], experiments: Collection[str]) -> tuple[int, int]:
    """Return how many hands of the population are flagged by limits from the other parts, and how many were judged.

    The limits that ship are made from all parts, so they flag somewhat fewer.

    Args:
        outcomes: of healthy hands.
        experiments: whose limits are made.
    """
    hands = [outcome for outcome in outcomes if outcome.trial.unit.startswith(PLAUSIBLE)]
    others = [outcome for outcome in outcomes if not outcome.trial.unit.startswith(PLAUSIBLE)]
    accused = judged = 0
    for part in range(FOLDS):
        rest = [hand for place, hand in enumerate(hands) if place % FOLDS != part]
        try:
            limits = computed_limits(CHECKS, healthy_hands_of([*rest, *others]), experiments)
        except ValueError:  # the only hands of some firmware are in this part
            continue
        for hand in hands[part::FOLDS]:
            trial = hand.trial
            own = [limit for limit in limits if limit.holds_for(trial.firmware, guarded=trial.guarded)]
            accused += not all(within_limits(excess) for excess in excesses(hand.numbers, own).values())
            judged += 1
    return accused, judged
