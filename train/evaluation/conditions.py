"""Under what a policy is measured: the training conditions, the deployment settings, and a sweep of the servo's lag."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from aero.policy.file import Policy
from aero.policy.settings import PAPER_DEPLOYMENT
from train.actuation import ActuationRanges
from train.evaluation.rollouts import Episodes, run, task_of
from train.simulator import Batch
from train.task.episode import Task
from train.task.grasp import NOMINAL_RESET

SERVO_LAG_S = 0.025
"""Closed loop of the physical hand's servos; the sweep's lag."""
SWEEP_DELAYS_S = (0.0, 0.010, 0.020, 0.030, 0.040, 0.050)


@dataclass(frozen=True)
class Condition:
    """One way to measure a policy in the simulator."""

    name: str
    """For tables."""
    task: Task
    """Settings, starts, actuation."""


def servo(lag_s: float, delay_s: float) -> ActuationRanges:
    """Return an actuation with one lag and one delay."""
    return ActuationRanges(lag_s=(lag_s, lag_s), delay_s=(delay_s, delay_s))


def conditions(policy: Policy) -> list[Condition]:
    """Return the conditions without a sweep: as trained, with and without noise, and as the paper deploys."""
    as_trained = task_of(policy)
    deployed = task_of(policy, PAPER_DEPLOYMENT)
    return [
        Condition("as trained, with noise", as_trained),
        Condition("as trained, no noise", replace(as_trained, settings=replace(policy.settings, noise=(0.0,) * 7))),
        Condition("deployed, nominal grasp", replace(deployed, reset=NOMINAL_RESET)),
    ]


def sweep(policy: Policy) -> list[tuple[float, Condition]]:
    """Return the training conditions behind a servo, with the delay (s) of each."""
    base = task_of(policy)
    return [
        (delay, Condition(f"lag {SERVO_LAG_S * 1e3:.0f}, delay {delay * 1e3:.0f} ms", behind))
        for delay in SWEEP_DELAYS_S
        for behind in [replace(base, actuation=servo(SERVO_LAG_S, delay))]
    ]


def measure(
    policy: Policy,
    cases: list[Condition],
    batch: Batch,
    *,
    seconds: float,
    seed: int,
    progress: Callable[[str], None] = lambda _: None,
) -> dict[str, Episodes]:
    """Run `policy` under each condition in every scene of `batch`; names to episodes."""
    results = {}
    for case in cases:
        progress(case.name)
        results[case.name] = run(policy, case.task, batch, seconds, seed)
    return results
