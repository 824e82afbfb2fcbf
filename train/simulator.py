"""Many hands at once in native MuJoCo: `mujoco.rollout` over all cores, one call a control period."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Self

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray

from aero.actuation.arrays import Array
from train.task import STATE_POSITIONS, STATE_VELOCITIES

Floats = NDArray[np.float64]
StopCheck = Callable[[], None]
"""Called between two batches of physics; what it raises ends the work."""
STATE_KIND = mujoco.mjtState.mjSTATE_FULLPHYSICS
_POSITIONS = slice(1, 1 + STATE_POSITIONS)
_VELOCITIES = slice(1 + STATE_POSITIONS, 1 + STATE_POSITIONS + STATE_VELOCITIES)


class Simulator:
    """A batch of training scenes, one model each, over a thread pool; remembers nothing of any episode.

    Use it as a context manager. A state is (time, positions (23), velocities (22)).
    """

    def __init__(self, models: Sequence[mujoco.MjModel], threads: int | None = None) -> None:
        """Make a batch of `len(models)` scenes on `threads` threads (default: all cores)."""
        self.models = list(models)
        """The scenes' models."""
        self.state_size = mujoco.mj_stateSize(self.models[0], STATE_KIND)
        threads = threads or os.cpu_count() or 1
        self._data = [mujoco.MjData(self.models[0]) for _ in range(threads)]
        self._pool = rollout.Rollout(nthread=threads)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.close()

    def __len__(self) -> int:
        return len(self.models)

    def advance(self, states: Floats, controls: Floats) -> tuple[Floats, Floats]:
        """Step every scene.

        Args:
            states: (batch, state_size).
            controls: (batch, steps, 7), m, abduction rad; MuJoCo clamps them to the actuator ranges.

        Returns:
            The states after the last step, (batch, state_size), and the sensors of every step, (batch, steps, 43).
        """
        trajectory, sensors = self._pool.rollout(self.models, self._data, states, controls)
        return trajectory[:, -1], sensors

    def at(self, starts: Floats) -> Floats:
        """Return states at rest at `starts` (batch, 23)."""
        states = np.zeros((len(self), self.state_size))
        states[:, _POSITIONS] = starts
        return states

    def sensors_at(self, starts: Floats, control: Floats) -> Floats:
        """Return the sensors at rest at `starts` (batch, 23) under `control` (7,), (batch, 43)."""
        controls = np.broadcast_to(control, (len(self), 1, len(control)))
        return self.advance(self.at(starts), controls)[1][:, 0]


def positions(states: Array) -> Array:
    """Return the generalised positions in `states`, (..., 23)."""
    return states[..., _POSITIONS]


def velocities(states: Array) -> Array:
    """Return the generalised velocities in `states`, (..., 22)."""
    return states[..., _VELOCITIES]
