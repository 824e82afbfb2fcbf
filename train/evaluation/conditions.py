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
"""Closed loop of the physical hand's servos; the lag of the delay sweep."""
SERVO_DELAY_S = 0.025
"""From a command to its motion and into the next reading, rounded up; the delay of the lag sweep."""
SWEEP_LAGS_S = (0.015, 0.040, 0.060)
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
    """Return the conditions without a sweep: as trained, with noise, without, and late; and as the paper deploys."""
    as_trained = task_of(policy)
    deployed = task_of(policy, PAPER_DEPLOYMENT)
    return [
        Condition("as trained, with noise", as_trained),
        Condition("as trained, no noise", replace(as_trained, settings=replace(policy.settings, noise=(0.0,) * 7))),
        Condition("as trained, a period late", replace(as_trained, actuation=servo(0.0, policy.settings.period_s))),
        Condition("deployed, nominal grasp", replace(deployed, reset=NOMINAL_RESET)),
    ]


def delay_sweep(policy: Policy) -> list[tuple[float, Condition]]:
    """Return the training conditions behind a servo of `SERVO_LAG_S`, with the delay (s) of each."""
    return [(delay_s, _behind(policy, SERVO_LAG_S, delay_s)) for delay_s in SWEEP_DELAYS_S]


def lag_sweep(policy: Policy) -> list[Condition]:
    """Return the training conditions behind slower and faster servos, with `SERVO_DELAY_S` each."""
    return [_behind(policy, lag_s, SERVO_DELAY_S) for lag_s in SWEEP_LAGS_S]


def _behind(policy: Policy, lag_s: float, delay_s: float) -> Condition:
    name = f"lag {lag_s * 1e3:.0f}, delay {delay_s * 1e3:.0f} ms"
    return Condition(name, replace(task_of(policy), actuation=servo(lag_s, delay_s)))


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
