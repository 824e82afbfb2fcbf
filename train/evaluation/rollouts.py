"""Run a policy for many episodes at once and measure them; the policy is the deployed NumPy network."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aero.policy.file import Policy
from aero.policy.settings import PolicySettings
from aero.policy.task import CHANNELS, targets
from model.scene import SETTLING_S
from train import actuation
from train.simulator import Floats, Simulator, StopCheck, positions, velocities
from train.task import Episode, EpisodeOutcome, Task, begin, command, draw_starts, finish, observed, unpack


@dataclass(frozen=True)
class Episodes:
    """What each episode did until its end or the loss of the cube; arrays are (episodes,) unless said."""

    kept: NDArray[np.bool_]
    """Whether the cube was still in the hand at the end."""
    alive_s: Floats
    """Time until then or until the loss, s."""
    rotation_rad: Floats
    """Rotation about the vertical, integrated at every physics step, rad."""
    airborne: Floats
    """Share of the physics steps after `SETTLING_S` without any contact of the cube."""
    travel_per_s: Floats
    """Commanded travel of each channel, (episodes, 7), m/s, abduction rad/s."""

    @property
    def rate_rad_s(self) -> Floats:
        """Mean angular velocity of each episode, rad/s."""
        return self.rotation_rad / self.alive_s

    def summary(self) -> dict[str, float]:
        """Return the figures of the whole set, SI units."""
        return {
            "episodes": float(len(self.kept)),
            "survival": float(np.mean(self.kept)),
            # Not the mean of the rates: one that drops its cube at once has any rate.
            "rate_rad_s": float(np.sum(self.rotation_rad) / np.sum(self.alive_s)),
            "rate_error_rad_s": float(np.std(self.rate_rad_s) / np.sqrt(len(self.kept))),
            "rotation_median_rad": float(np.median(self.rotation_rad)),
            "alive_s": float(np.mean(self.alive_s)),
            "airborne": float(np.average(self.airborne, weights=self.alive_s)),
            "finger_travel_m_s": float(np.mean(self.travel_per_s[:, :4])),
        }


def task_of(policy: Policy, settings: PolicySettings | None = None) -> Task:
    """Return the paper's task as `policy` sees it, under its own settings unless others are given."""
    return Task(settings=settings or policy.settings, shown_action=policy.shown_action)


def run(
    policy: Policy,
    task: Task,
    batch: Simulator,
    seconds: float,
    seed: int = 0,
    *,
    check: StopCheck = lambda: None,
) -> Episodes:
    """Run one episode in every scene of `batch`.

    Args:
        policy: what acts.
        task: its settings, starts and actuation; noise as in its settings.
        batch: scenes made with `build_scene`.
        seconds: length of an episode, s.
        seed: of starts, actuation and noise.
        check: called after each control period; what it raises ends the run.
    """
    rng, count = np.random.default_rng(seed), len(batch)
    tally = _Tally(task, count)
    starts = draw_starts(rng, count, task.reset)
    states = batch.at(starts)
    sensors = batch.sensors_at(starts, np.array(task.settings.nominal))
    episode = begin(task, sensors, rng.uniform(size=(count, actuation.DRAWS)))
    observation = observed(task, episode, rng.uniform(-1, 1, (count, CHANNELS)))
    for _ in range(round(seconds / task.settings.period_s)):
        action = policy.network.act(observation).astype(np.float64)
        episode, controls = command(task, episode, action)
        states, sensors = batch.advance(states, controls)
        noise = rng.uniform(-1, 1, (count, CHANNELS))
        episode, outcome = finish(
            task, episode, sensors, positions=positions(states), velocities=velocities(states), noise=noise
        )
        observation = outcome.observation
        tally.add(episode, sensors, outcome)
        check()
    return tally.episodes()


class _Tally:
    """Sums over the steps of the episodes that still hold their cube."""

    def __init__(self, task: Task, count: int) -> None:
        self._task = task
        self._alive = np.ones(count, bool)
        self._steps, self._rotation, self._airborne, self._observed = np.zeros((4, count))
        self._travel = np.zeros((count, CHANNELS))

    def add(self, episode: Episode, sensors: Floats, outcome: EpisodeOutcome) -> None:
        action, before = episode.memory.last, episode.memory.before_last
        period_s, alive = self._task.settings.period_s, self._alive
        nominal, scale = np.array(self._task.settings.nominal), np.array(self._task.settings.scale)
        travel = np.abs(targets(action, nominal, scale) - targets(before, nominal, scale))
        self._rotation += alive * unpack(sensors).cube_angular_velocity[..., 2].mean(axis=-1) * period_s
        self._travel += alive[:, None] * travel
        self._steps += alive
        settled = alive & (episode.periods * period_s > SETTLING_S)
        self._airborne += settled * outcome.terms["airborne"]
        self._observed += settled
        self._alive = alive & ~outcome.lost

    def episodes(self) -> Episodes:
        alive_s = self._steps * self._task.settings.period_s
        return Episodes(
            kept=self._alive,
            alive_s=alive_s,
            rotation_rad=self._rotation,
            airborne=self._airborne / np.maximum(self._observed, 1),
            travel_per_s=self._travel / alive_s[:, None],
        )
