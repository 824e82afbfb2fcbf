"""Many hands at once in native MuJoCo: `mujoco.rollout` over all cores, one call a control period."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Self

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray

from aero.actuation.arrays import Array
from train.task import STATE_POSITIONS, STATE_VELOCITIES

Floats = NDArray[np.float64]
STATE_KIND = mujoco.mjtState.mjSTATE_FULLPHYSICS
_POSITIONS = slice(1, 1 + STATE_POSITIONS)
_VELOCITIES = slice(1 + STATE_POSITIONS, 1 + STATE_POSITIONS + STATE_VELOCITIES)


class Batch(ABC):
    """A batch of training scenes, one model each; remembers nothing of any episode.

    A state is (time, positions (23), velocities (22)).
    """

    def __init__(self, models: Sequence[mujoco.MjModel]) -> None:
        self._models = list(models)
        self.state_size = mujoco.mj_stateSize(self._models[0], STATE_KIND)

    @property
    def models(self) -> list[mujoco.MjModel]:
        """The scenes' models."""
        return self._models

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:  # noqa: B027 - most batches hold nothing
        """Give back what the batch holds."""

    def __len__(self) -> int:
        return len(self._models)

    @abstractmethod
    def advance(self, states: Floats, controls: Floats) -> tuple[Floats, Floats]:
        """Step every scene.

        Args:
            states: (batch, state_size).
            controls: (batch, steps, 7), m, abduction rad; MuJoCo clamps them to the actuator ranges.

        Returns:
            The states after the last step, (batch, state_size), and the sensors of every step, (batch, steps, 43).
        """

    def at(self, starts: Floats) -> Floats:
        """Return states at rest at `starts` (batch, 23)."""
        states = np.zeros((len(self), self.state_size))
        states[:, _POSITIONS] = starts
        return states

    def sensors_at(self, starts: Floats, control: Floats) -> Floats:
        """Return the sensors at rest at `starts` (batch, 23) under `control` (7,), (batch, 43)."""
        controls = np.broadcast_to(control, (len(self), 1, len(control)))
        return self.advance(self.at(starts), controls)[1][:, 0]


class Simulator(Batch):
    """The batch over native MuJoCo; holds a thread pool. Use as a context manager, or `close` it."""

    def __init__(self, models: Sequence[mujoco.MjModel], threads: int | None = None) -> None:
        """Make a batch of `len(models)` scenes on `threads` threads (default: all cores)."""
        super().__init__(models)
        threads = threads or os.cpu_count() or 1
        self._data = [mujoco.MjData(self._models[0]) for _ in range(threads)]
        self._pool = rollout.Rollout(nthread=threads)

    def close(self) -> None:
        """Stop the threads."""
        self._pool.close()

    def advance(self, states: Floats, controls: Floats) -> tuple[Floats, Floats]:
        """Step every scene, see `Batch`."""
        trajectory, sensors = self._pool.rollout(self._models, self._data, states, controls)
        return trajectory[:, -1], sensors


def positions(states: Array) -> Array:
    """Return the generalised positions in `states`, (..., 23)."""
    return states[..., _POSITIONS]


def velocities(states: Array) -> Array:
    """Return the generalised velocities in `states`, (..., 22)."""
    return states[..., _VELOCITIES]
