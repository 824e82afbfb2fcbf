"""The interface behind the servos: output shafts and whatever hangs on them.

The electronics know this interface and no implementation. `model` implements it with the built hand and with the joints
of any MJCF file, `bench` here with seven bare shafts.

Of the hand, which has seven: a shaft's angle is zero at the fully extended hand and grows as its channel closes (paper
section "Notation", theta). Shafts are listed in command order: index, middle, ring, pinky, thumb abduction, thumb CMC
flexion, thumb flexor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

SHAFTS = 7


@dataclass(frozen=True)
class Drive:
    """What one servo asks of its motor until it asks for something else.

    `effort = clip(torque + stiffness * (setpoint - angle) - damping * speed, -limit, limit)` is the motor's voltage;
    `clip(effort - back_emf, -current_limit, current_limit)`, with the plant's back-EMF, turns the shaft.
    Torque off is a drive of zeros with `powered=False`.
    """

    setpoint: float = 0.0
    """Goal angle, rad."""
    stiffness: float = 0.0
    """Position gain, N m/rad; zero in torque modes."""
    damping: float = 0.0
    """Speed gain, N m s/rad."""
    torque: float = 0.0
    """Feed-forward, N m, positive closes."""
    limit: float = 0.0
    """Bound on the effort, N m, not negative."""
    current_limit: float = math.inf
    """Bound on the effort less back-EMF, N m: a torque limit holds a blocked shaft back and not a fast one."""
    powered: bool = True
    """Whether the winding is driven; when not, there is no back-EMF either and the shaft turns freely."""

    def effort(self, setpoint: float, angle: float, speed: float) -> float:
        """Return the effort, N m, with another goal, rad, of a shaft at an angle, rad, and a speed, rad/s."""
        effort = self.torque + self.stiffness * (setpoint - angle) - self.damping * speed
        return min(max(effort, -self.limit), self.limit)


class ShaftState(NamedTuple):
    """Shafts at one instant, in command order; nobody writes to it."""

    angles: list[float]
    """rad."""
    speeds: list[float]
    """rad/s."""
    efforts: list[float]
    """N m."""


class Plant(Protocol):
    """Shafts in time, a base of those that work out `state`. Everything is deterministic; no wall clock is read."""

    @property
    def time(self) -> float:
        """Simulated time, s."""
        ...

    def advance_to(self, t: float) -> None:
        """Integrate to exactly `t` (s) with the present drives; nothing happens when `t` is not later than `time`."""
        ...

    def drive(self, shaft: int, drive: Drive) -> None:
        """Replace the drive of one shaft, counted from 0, from now on."""
        ...

    def set_setpoint(self, shaft: int, setpoint: float) -> None:
        """Change only the goal angle (rad) of one shaft's present drive; the cheap call a motion profile makes."""
        ...

    def state(self) -> ShaftState:
        """Return angles, speeds and efforts of the shafts at once."""
        ...

    def angles(self) -> NDArray[np.float64]:
        """Return shaft angles, (n,) float, rad; of the hand, positive closes."""
        return np.array(self.state().angles)

    def speeds(self) -> NDArray[np.float64]:
        """Return shaft speeds, (n,) float, rad/s."""
        return np.array(self.state().speeds)

    def efforts(self) -> NDArray[np.float64]:
        """Return the clipped efforts of the drives at the present state, (n,) float, N m, before back-EMF."""
        return np.array(self.state().efforts)
