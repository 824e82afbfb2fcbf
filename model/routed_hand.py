"""The routed hand in time: commands in, cable lengths out; what the harness compares a target against."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.channels import Channel, Joint
from model.geometry import Side
from model.routed import COMMAND_RANGE, TENDONS, build_routed


class RoutedHand:
    """A thin simulator of the routed hand; deterministic, and alone in its world.

    The hand starts, and restarts after `reset`, at rest in the extended pose with the command that holds it there.
    """

    def __init__(self, hand: Side = "right") -> None:
        self._model = build_routed(hand).compile()
        self._data = mujoco.MjData(self._model)
        self._tendon_ids = np.array([self._model.tendon(name).id for name in TENDONS.values()])
        self._tendon_channels = np.array(list(TENDONS))
        self._command_range = [COMMAND_RANGE[channel] for channel in Channel]
        self._timestep = float(self._model.opt.timestep)
        self.reset()

    @property
    def command_range(self) -> NDArray[np.float64]:
        """Admissible commands, (7, 2) float, command order; m, abduction rad."""
        return np.array(self._command_range)

    @property
    def time(self) -> float:
        """Simulated time since the last reset, s."""
        return float(self._data.time)

    @property
    def timestep(self) -> float:
        """Length of one step, s."""
        return self._timestep

    def reset(self) -> None:
        """Return to rest in the extended pose at time zero, commanded to stay there."""
        mujoco.mj_resetData(self._model, self._data)
        mujoco.mj_forward(self._model, self._data)
        self.command(np.clip(self.lengths(), *self.command_range.T))

    def command(self, lengths: ArrayLike) -> None:
        """Set the goals of the seven actuators.

        Args:
            lengths: (7,) float, command order; cable lengths in m, abduction in rad, within `command_range`.

        Raises:
            ValueError: wrong shape, not finite, or out of range.
        """
        goal = np.asarray(lengths, dtype=float)
        if goal.shape != (len(Channel),):
            raise ValueError(f"a command has shape (7,), command order, not {goal.shape}")
        for number, (value, (low, high)) in enumerate(zip(goal.tolist(), self._command_range, strict=True)):
            if not low <= value <= high:
                raise ValueError(
                    f"{Channel(number).label}: command {value} is outside "
                    f"[{low}, {high}]; clip it to `command_range` if that is meant"
                )
        self._data.ctrl[:] = goal

    def advance(self, seconds: float) -> None:
        """Integrate for `seconds`, a whole number of 10 ms steps.

        Raises:
            ValueError: negative, or not a multiple of the step.
        """
        steps = round(seconds / self._timestep)
        if steps < 0 or abs(steps * self._timestep - seconds) > 1e-6:
            raise ValueError(f"{seconds} s is not a whole number of {self._timestep} s steps")
        # Halves of mj_step in turned order: the positions that the sensors show are the next step's as well.
        for _ in range(steps):
            mujoco.mj_step2(self._model, self._data)
            mujoco.mj_step1(self._model, self._data)

    def lengths(self) -> NDArray[np.float64]:
        """Return what the sensors read now, (7,) float, command order; cable lengths in m, abduction in rad."""
        readings = np.empty(len(Channel))
        readings[self._tendon_channels] = self._data.ten_length[self._tendon_ids]
        readings[Channel.THUMB_ABDUCTION] = self._data.qpos[Joint.THUMB_ABDUCTION]
        return readings

    def joint_angles(self) -> NDArray[np.float64]:
        """Return the joint angles, (16,) float, rad, in the order of `Joint`."""
        angles: NDArray[np.float64] = self._data.qpos.copy()
        return angles
