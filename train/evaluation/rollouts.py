"""Run a policy for many episodes at once and measure them; the policy is the deployed NumPy network."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aero.policy.file import Policy
from aero.policy.settings import PolicySettings
from aero.policy.task import CHANNELS, targets
from model.cubes import SETTLING_S
from model.film import check_drawing, frames
from train import actuation
from train.actuation import SPEED_LIMIT
from train.scene import build_scene
from train.simulator import Batch, Floats, Simulator, positions, velocities
from train.task.episode import Episode, EpisodeOutcome, Task, begin, command, finish, observed
from train.task.grasp import draw_starts
from train.task.signals import unpack


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
    action_change: Floats
    """Mean of the norm of the action's change from one step to the next."""
    travel_per_s: Floats
    """Commanded travel of each channel, (episodes, 7), m/s, abduction rad/s."""
    overspeed: Floats
    """Share of commanded changes that the servo cannot make within a control period."""

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
            "action_change": float(np.mean(self.action_change)),
            "finger_travel_m_s": float(np.mean(self.travel_per_s[:, :4])),
            "overspeed": float(np.mean(self.overspeed)),
        }


def task_of(policy: Policy, settings: PolicySettings | None = None) -> Task:
    """Return the paper's task as `policy` sees it, under its own settings unless others are given."""
    return Task(settings=settings or policy.settings, shown_action=policy.shown_action)


class Log(NamedTuple):
    """One episode, step by step; each after the action of that control period."""

    positions: Floats
    """Generalised positions, (steps, 23)."""
    actions: Floats
    """(steps, 7)"""
    lengths: Floats
    """Channel values, (steps, 7), m, abduction rad."""


def log(policy: Policy, task: Task, seconds: float, seed: int = 0) -> Log:
    """Run one episode in native MuJoCo and keep all of it; arguments as for `run`."""
    rows: list[tuple[Floats, Floats, Floats]] = []
    with Simulator([build_scene(policy.settings.torque_limit).compile()], threads=1) as batch:
        _run(policy, task, batch, seconds, rng=np.random.default_rng(seed), on_period=lambda *s: rows.append(_row(*s)))
    return Log(*(np.array(column) for column in zip(*rows, strict=True)))


def check_video() -> None:
    """Try what a video needs, before any work.

    Raises:
        ValueError: the extra `train` is not installed, or nothing can be drawn here.
    """
    if find_spec("imageio") is None:
        raise ValueError("--video needs the extra `train`")
    check_drawing("--video")


def video(positions: Floats, path: Path, period_s: float) -> None:
    """Write positions (steps, 23), `period_s` apart, as an MP4. Needs OpenGL; without a display set `MUJOCO_GL=egl`."""
    import imageio.v3 as imageio  # noqa: PLC0415 - only videos need it

    imageio.imwrite(path, np.array(list(frames(positions))), fps=round(1.0 / period_s))


def run(
    policy: Policy, task: Task, batch: Batch, seconds: float, seed: int = 0, *, check: Callable[[], None] = lambda: None
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
    tally = _Tally(task, len(batch))

    def add(episode: Episode, states: Floats, sensors: Floats, outcome: EpisodeOutcome) -> None:
        tally.add(episode, states, sensors, outcome)
        check()

    _run(policy, task, batch, seconds, rng=np.random.default_rng(seed), on_period=add)
    return tally.episodes()


def _run(
    policy: Policy,
    task: Task,
    batch: Batch,
    seconds: float,
    *,
    rng: np.random.Generator,
    on_period: Callable[[Episode, Floats, Floats, EpisodeOutcome], None],
) -> None:
    """Run episodes and tell `on_period` the episode, states, sensors and outcome after each control period."""
    count = len(batch)
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
        on_period(episode, states, sensors, outcome)


def _row(episode: Episode, states: Floats, _sensors: Floats, _outcome: EpisodeOutcome) -> tuple[Floats, Floats, Floats]:
    return positions(states)[0], episode.memory.last[0], episode.lengths[0]


class _Tally:
    """Sums over the steps of the episodes that still hold their cube."""

    def __init__(self, task: Task, count: int) -> None:
        self._task = task
        self._alive = np.ones(count, bool)
        self._steps, self._rotation, self._change, self._overspeed = np.zeros((4, count))
        self._airborne, self._observed = np.zeros((2, count))
        self._travel = np.zeros((count, CHANNELS))

    def add(self, episode: Episode, _states: Floats, sensors: Floats, outcome: EpisodeOutcome) -> None:
        action, before = episode.memory.last, episode.memory.before_last
        period_s, alive = self._task.settings.period_s, self._alive
        nominal, scale = np.array(self._task.settings.nominal), np.array(self._task.settings.scale)
        travel = np.abs(targets(action, nominal, scale) - targets(before, nominal, scale))
        self._rotation += alive * unpack(sensors).cube_angular_velocity[..., 2].mean(axis=-1) * period_s
        self._change += alive * np.linalg.norm(action - before, axis=-1)
        self._travel += alive[:, None] * travel
        self._overspeed += alive * (travel > SPEED_LIMIT * period_s).mean(axis=-1)
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
            action_change=self._change / self._steps,
            travel_per_s=self._travel / alive_s[:, None],
            overspeed=self._overspeed / self._steps,
        )
