"""Measure the current by which `aero.policy.held` detects a cube: `python -m train.held_currents`.

Prints the swing of CMC flexion's current over windows of the shipped policy, with and without a cube, and the share of
windows above the threshold in force. Run it after each change of the policy.
"""

from functools import partial

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


def measured(*, empty: bool) -> Floats:
    """Return the swings of all windows of `HANDS` hands, A."""
    with worker_processes(usable_cores()) as workers:
        return np.concatenate(list(workers.map(partial(swings_a, empty=empty), range(SEED, SEED + HANDS))))


if __name__ == "__main__":
    for name, empty in (("empty", True), ("with a cube", False)):
        swings = measured(empty=empty)
        print(
            f"{name}: {len(swings)} windows, largest {swings.max():.2f} A, "
            f"{np.mean(swings > HELD_A):.0%} above {HELD_A} A"
        )
