"""What a trial may add to a hand: gravity off its axis, a shove, a jolt, and a host that rounds to whole degrees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.policy.running import PolicyHand
from aero.protocol import MAX_CODE
from model.cube_plant import CubePlant

Floats = NDArray[np.float64]

AT_S = 5.0
"""When a shove or a jolt comes, s under the policy."""
JOLT_S = 0.1
"""How long a jolt lasts, s."""


@dataclass(frozen=True)
class Disturbance:
    """How strong each is; the direction, horizontal, is drawn with the trial."""

    tilt_rad: float = 0.0
    """Angle of gravity to the axis that the policy was trained with, all the time."""
    shove_m_s: float = 0.0
    """Change of the cube's velocity."""
    jolt_m_s2: float = 0.0
    """Acceleration of the hand."""


NONE = Disturbance()


class Disturber:
    """Brings a disturbance to a plant."""

    def __init__(self, plant: CubePlant, disturbance: Disturbance, seed: int) -> None:
        """Tilt gravity at once; the direction is drawn from `seed`."""
        self._plant, self._disturbance = plant, disturbance
        angle = np.random.default_rng((seed, 1)).uniform(0.0, 2.0 * np.pi)
        self._direction: NDArray[np.float64] = np.array([np.cos(angle), np.sin(angle), 0.0])
        self._before: float | None = None
        down = plant.gravity_m_s2
        strength = float(np.linalg.norm(down))
        self._gravity = np.cos(disturbance.tilt_rad) * down + np.sin(disturbance.tilt_rad) * strength * self._direction
        plant.lean(self._gravity)

    def act(self, t: float) -> None:
        """Do what comes at time `t`, s under the policy; called after every control period."""
        before, self._before = self._before if self._before is not None else t, t
        if before < AT_S <= t:
            self._plant.shove_cube(self._disturbance.shove_m_s * self._direction)
        jolted = AT_S <= t < AT_S + JOLT_S
        self._plant.lean(self._gravity - (self._disturbance.jolt_m_s2 * self._direction if jolted else 0.0))


@dataclass(frozen=True)
class CoarseHand:
    """Passes everything on; positions only in multiples of `step_codes`."""

    hand: PolicyHand
    step_codes: Floats
    """Codes that a step of each channel has, (7,)."""

    def read_codes(self) -> NDArray[np.uint16]:
        """Read positions, (7,), command order."""
        return self._rounded(self.hand.read_codes())

    def command_codes(self, codes: ArrayLike) -> None:
        """Send every channel to a position, (7,), command order."""
        self.hand.command_codes(self._rounded(codes))

    def read_currents(self) -> Floats:
        """Read motor currents, (7,), A, command order."""
        return self.hand.read_currents()

    def read_temperatures(self) -> Floats:
        """Read servo temperatures, (7,), °C, command order."""
        return self.hand.read_temperatures()

    def _rounded(self, codes: ArrayLike) -> NDArray[np.uint16]:
        steps = np.round(np.asarray(codes, dtype=float) / self.step_codes)
        return np.clip(np.round(steps * self.step_codes), 0, MAX_CODE).astype(np.uint16)


def step_codes(window_rad: Floats, step_rad: float) -> Floats:
    """Return how many codes a step of the shafts has, (7,), for windows (7, 2)."""
    steps: Floats = MAX_CODE * step_rad / np.abs(np.diff(window_rad, axis=1)[:, 0])
    return steps
