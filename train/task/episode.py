"""An episode without its physics: from action to controls, and from signals to observation, reward and end.

One copy for every backend: `train.environment` runs it in JAX over native MuJoCo or MJX, `train.evaluation` in NumPy.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from aero.actuation.arrays import Array, namespace
from aero.policy.settings import PAPER_TRAINING, PolicySettings
from aero.policy.task import ActionMemory, ShownAction, observe, targets
from train import actuation
from train.actuation import IDEAL, ActuationRanges, Parameters, ServoState
from train.task.grasp import PAPER_RESET, ResetRanges
from train.task.reward import PAPER_REWARD, RewardSettings, fallen, reward, terms
from train.task.signals import Signals, critic_state, unpack

PHYSICS_STEP_S = 0.010


@dataclass(frozen=True)
class Task:
    """The whole task; the defaults are the paper's.

    Raises:
        ValueError: a control period that is not a whole number of physics steps, or actuation out of range.
    """

    settings: PolicySettings = PAPER_TRAINING
    """Nominal grasp, scales, noise, rate."""
    shown_action: ShownAction = ShownAction.LAST
    """Which action the observation shows."""
    rewarded: RewardSettings = PAPER_REWARD
    """What is rewarded."""
    reset: ResetRanges = PAPER_RESET
    """Where episodes start."""
    actuation: ActuationRanges = IDEAL
    """What the hand does to commands and readings."""
    episode_steps: int = 500
    """Control steps after which an episode is cut off."""

    def __post_init__(self) -> None:
        if abs(self.substeps * PHYSICS_STEP_S - self.settings.period_s) > 1e-9:
            raise ValueError(f"a control period must be whole {PHYSICS_STEP_S} s steps, got {self.settings.period_s} s")
        actuation.check(self.actuation, self.settings.period_s)

    @property
    def substeps(self) -> int:
        """Physics steps a control period."""
        return round(self.settings.period_s / PHYSICS_STEP_S)


class Episode(NamedTuple):
    """What an episode remembers besides its physics; leading axes are free."""

    memory: ActionMemory
    parameters: Parameters
    servo: ServoState
    lengths: Array
    """Simulated channel values at the end of the last period, (..., 7)."""
    periods: Array
    """Control periods that have passed, (...)."""


class EpisodeOutcome(NamedTuple):
    """What a control period gave; leading axes as in the episode."""

    observation: Array
    """(..., 14)"""
    critic: Array
    """(..., 81)"""
    reward: Array
    lost: Array
    """Whether the cube has fallen, bool."""
    terms: dict[str, Array]
    """The reward's terms before weighting."""


def begin(task: Task, sensors: Array, uniform: Array) -> Episode:
    """Start episodes with the servos at rest on the nominal targets.

    Args:
        task: the task.
        sensors: sensors of the start, (..., 43).
        uniform: draws from [0, 1] for the actuation, (..., `actuation.DRAWS`).
    """
    lengths = unpack(sensors).lengths
    return Episode(
        memory=ActionMemory.empty(lengths),
        parameters=actuation.parameters(task.actuation, uniform),
        servo=actuation.at_rest(0 * lengths + np.array(task.settings.nominal)),
        lengths=lengths,
        periods=0 * lengths[..., 0],
    )


def command(task: Task, episode: Episode, action: Array) -> tuple[Episode, Array]:
    """Turn an action (..., 7) into the controls of the period's physics steps, (..., substeps, 7)."""
    nominal, scale = np.array(task.settings.nominal), np.array(task.settings.scale)
    servo, controls = actuation.drive(
        episode.servo,
        targets(action, nominal, scale),
        episode.parameters,
        nominal,
        steps=task.substeps,
        step_s=PHYSICS_STEP_S,
        ranges=task.actuation,
    )
    return episode._replace(memory=episode.memory.after(action), servo=servo), controls


def observed(task: Task, episode: Episode, noise: Array) -> Array:
    """Return the observation, (..., 14), for sensor noise drawn from [-1, 1], (..., 7)."""
    nominal = np.array(task.settings.nominal)
    reading = actuation.read(episode.lengths, episode.parameters, nominal, task.actuation.counts)
    return observe(reading + np.array(task.settings.noise) * noise, episode.memory.shown(task.shown_action))


def finish(
    task: Task, episode: Episode, sensors: Array, *, positions: Array, velocities: Array, noise: Array
) -> tuple[Episode, EpisodeOutcome]:
    """Close a control period.

    Args:
        task: the task.
        episode: as `command` left it.
        sensors: of every physics step of the period, (..., substeps, 43).
        positions: generalised positions at its end, (..., 23).
        velocities: generalised velocities at its end, (..., 22).
        noise: draws from [-1, 1], (..., 7).
    """
    period, period_s = unpack(sensors), task.settings.period_s
    nominal, scale = np.array(task.settings.nominal), np.array(task.settings.scale)
    sent = [targets(action, nominal, scale) for action in episode.memory]
    last = Signals(*(part[..., -1, :] for part in period))
    values = terms(
        period,
        positions,
        last_lengths=episode.lengths,
        action=episode.memory.last,
        last_action=episode.memory.before_last,
        sent=namespace(sensors).maximum(*sent),
        period_s=period_s,
        rotation_cap_rad_s=task.rewarded.rotation_cap_rad_s,
    )
    episode = episode._replace(lengths=last.lengths, periods=episode.periods + 1)
    observation = observed(task, episode, noise)
    return episode, EpisodeOutcome(
        observation=observation,
        critic=critic_state(observation, positions, velocities, last),
        reward=reward(values, task.rewarded, period_s),
        lost=fallen(last.cube_position[..., 2]),
        terms=values,
    )
