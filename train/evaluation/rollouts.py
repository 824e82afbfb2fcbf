"""Batched episodes of a policy in simulation, with the deployed NumPy network."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aero.floats import Floats
from aero.policy.file import Policy
from aero.policy.settings import PolicySettings
from aero.policy.task import CHANNELS, targets
from simulator.scene import SETTLING_S
from train import actuation
from train.simulator import Simulator, StopCheck, positions, velocities
from train.task import OUT_OF_THE_HAND, Task, begin, command, draw_starts, finish, observed, unpack


@dataclass(frozen=True)
class Episodes:
    """Results of episodes, each up to its end or the loss of the cube; arrays are (episodes,) unless noted."""

    kept: NDArray[np.bool_]
    """Whether the cube was still in the hand at the end."""
    alive_s: Floats
    """Time until the end or the loss of the cube, s."""
    rotation_rad: Floats
    """Rotation about the vertical, integrated at every physics step, rad."""
    airborne: Floats
    """Fraction of the physics steps after `SETTLING_S` without any contact of the cube."""
    travel_per_s: Floats
    """Commanded travel of each channel, (episodes, 7), m/s, abduction rad/s."""

    @property
    def rate_rad_s(self) -> Floats:
        """Mean angular velocity of each episode, rad/s."""
        return self.rotation_rad / self.alive_s

    def summary(self) -> dict[str, float]:
        """Return the figures of all episodes, SI units."""
        return {
            "episodes": float(len(self.kept)),
            "survival": float(np.mean(self.kept)),
            # A mean of the rates would be noisy: an early drop makes a rate arbitrary.
            "rate_rad_s": float(np.sum(self.rotation_rad) / np.sum(self.alive_s)),
            "rate_error_rad_s": float(np.std(self.rate_rad_s) / np.sqrt(len(self.kept))),
            "rotation_median_rad": float(np.median(self.rotation_rad)),
            "alive_s": float(np.mean(self.alive_s)),
            "airborne": float(np.average(self.airborne, weights=self.alive_s)),
            "finger_travel_m_s": float(np.mean(self.travel_per_s[:, :4])),
        }


def task_of(policy: Policy, settings: PolicySettings | None = None) -> Task:
    """Return the paper's task with our loss rule, the policy's observation, and its settings or the given ones."""
    return Task(settings=settings or policy.settings, shown_action=policy.shown_action, loss=OUT_OF_THE_HAND)


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
        policy: the policy to run.
        task: settings (including noise), starts and actuation.
        batch: batch of scenes from `build_scene`.
        seconds: length of an episode, s.
        seed: seed of starts, actuation and noise.
        check: called after each control period; its exceptions end the run.
    """
    rng, count, period_s = np.random.default_rng(seed), len(batch), task.settings.period_s
    nominal, scale = np.array(task.settings.nominal), np.array(task.settings.scale)
    starts = draw_starts(rng, count, task.reset)
    states = batch.at(starts)
    sensors = batch.sensors_at(starts, nominal)
    episode = begin(task, sensors, rng.uniform(size=(count, actuation.DRAWS)))
    observation = observed(task, episode, rng.uniform(-1, 1, (count, CHANNELS)))
    # sums over the steps of episodes that still hold the cube
    alive, travel = np.ones(count, bool), np.zeros((count, CHANNELS))
    steps, rotation, airborne, settled_steps = np.zeros((4, count))
    for _ in range(round(seconds / period_s)):
        action = policy.network.act(observation).astype(np.float64)
        change = targets(action, nominal, scale) - targets(episode.memory.last, nominal, scale)
        episode, controls = command(task, episode, action)
        states, sensors = batch.advance(states, controls)
        noise = rng.uniform(-1, 1, (count, CHANNELS))
        episode, outcome = finish(
            task, episode, sensors, positions=positions(states), velocities=velocities(states), noise=noise
        )
        observation = outcome.observation
        rotation += alive * unpack(sensors).cube_angular_velocity[..., 2].mean(axis=-1) * period_s
        travel += alive[:, None] * np.abs(change)
        steps += alive
        settled = alive & (episode.periods * period_s > SETTLING_S)
        airborne += settled * outcome.terms["airborne"]
        settled_steps += settled
        alive = alive & ~outcome.lost
        check()
    alive_s = steps * period_s
    return Episodes(alive, alive_s, rotation, airborne / np.maximum(settled_steps, 1), travel / alive_s[:, None])
