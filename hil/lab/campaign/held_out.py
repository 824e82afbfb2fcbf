"""How well limits from a campaign hold hands that they were not made from."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from hil.checks import CHECKS
from hil.lab.campaign.population import healthy_hands_of
from hil.lab.campaign.trial import Outcome
from hil.lab.limits.compute import computed_limits
from hil.verdict.limits import excesses
from model.units.naming import PLAUSIBLE

FOLDS = 5
"""Parts of a campaign, each of which is judged by limits from the others."""


def held_out(outcomes: Sequence[Outcome], experiments: Collection[str]) -> tuple[int, int]:
    """Return how many hands of the population are accused by limits from the other parts, and how many were judged.

    The limits that ship are made from all parts, so they accuse somewhat fewer.

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
            accused += any(abs(excess) > 1.0 for excess in excesses(hand.numbers, own).values())
            judged += 1
    return accused, judged
