"""What happens to a hand and its cube in the middle of a trial: gravity off its axis, a shove, a jolt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.cube_plant import CubePlant

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
