"""Measure the current by which `aero.policy.held` detects a cube: `python -m train.held_currents`.

Prints the swing of CMC flexion's current over windows of the shipped policy, with and without a cube, and the share of
windows above the threshold in force. Run it after each change of the policy.
"""

from itertools import product

import numpy as np

from aero.channels import Channel
from aero.floats import Floats
from aero.policy.cables import MEASURED
from aero.policy.held import HELD_A, WINDOW_S
from aero.policy.running import Step
from aero.policy.shipped import DEFAULT, find_policy
from train.evaluation.cube_trial import run_trial
from train.evaluation.trials import over_hands
from train.workers import usable_cores, worker_processes

SEED, HANDS = 860_000, 24
"""First hand and number of hands; no training uses them."""
SECONDS = 15.0


def swings_a(seed: int, *, empty: bool) -> Floats:
    """Return the standard deviation of CMC flexion's current in each whole window of a run on a hand, (windows,), A."""
    policy = find_policy(DEFAULT)
    (case,) = over_hands(policy, 1, seconds=SECONDS, seed=seed, correct=MEASURED)
    currents: list[float] = []

    def keep(step: Step) -> None:
        currents.append(float(step.currents_a[Channel.THUMB_CMC_FLEXION]))

    run_trial(policy, case.spec, case.settings, measured=True, placed=not empty, on_step=keep)
    window = round(WINDOW_S / policy.settings.period_s)
    whole = len(currents) // window * window
    swings: Floats = np.abs(currents[:whole]).reshape(-1, window).std(axis=1)
    return swings


def _swings(case: tuple[int, bool]) -> Floats:
    return swings_a(case[0], empty=case[1])


def measured() -> dict[bool, Floats]:
    """Return the swings of all windows, A, of hands that are empty (True) and that hold a cube (False)."""
    cases = list(product(range(SEED, SEED + HANDS), (True, False)))
    with worker_processes(usable_cores()) as workers:
        found = list(workers.map(_swings, cases))
    return {
        kind: np.concatenate([one for one, (_, empty) in zip(found, cases, strict=True) if empty is kind])
        for kind in (True, False)
    }


if __name__ == "__main__":
    for empty, swings in measured().items():
        print(
            f"{'empty' if empty else 'with a cube'}: {len(swings)} windows, largest {swings.max():.2f} A, "
            f"{np.mean(swings > HELD_A):.0%} above {HELD_A} A"
        )
