"""Plant interface: the servos' output shafts and the mechanics behind them.

The electronics depend on this interface only. `model` implements it for the built hand and for the joints of any MJCF
file, `bench` for seven bare shafts.

Convention for the hand: a shaft's angle is zero at the fully extended hand and grows as its channel closes (paper
section "Notation", theta). The seven shafts are in command order: index, middle, ring, pinky, thumb abduction, thumb
CMC flexion, thumb flexor.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

SHAFTS = 7


@dataclass(frozen=True)
class Drive:
    """Control law of one servo's motor, in force until the next drive.

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
    """Bound on the effort less back-EMF, N m; limits the torque of a blocked shaft, not of a fast one."""
    powered: bool = True
    """Whether the winding is driven; an undriven one has no back-EMF and turns freely."""

    def effort(self, setpoint: float, angle: float, speed: float) -> float:
        """Return the effort (N m) for a setpoint (rad), at an angle (rad) and speed (rad/s) of the shaft."""
        effort = self.torque + self.stiffness * (setpoint - angle) - self.damping * speed
        return min(max(effort, -self.limit), self.limit)


class ShaftState(NamedTuple):
    """State of the shafts at one instant, in command order; treat the lists as read-only."""

    angles: list[float]
    """Angles, rad."""
    speeds: list[float]
    """Speeds, rad/s."""
    efforts: list[float]
    """Efforts before back-EMF, N m."""


class Plant(Protocol):
    """Deterministic simulation of shafts on virtual time; implementations supply `state`."""

    @property
    def time(self) -> float:
        """Simulated time, s."""
        ...

    def advance_to(self, t: float) -> None:
        """Integrate to exactly `t` (s) with the present drives; no effect unless `t` is later than `time`."""
        ...

    def drive(self, shaft: int, drive: Drive) -> None:
        """Replace the drive of one shaft; indices start at 0."""
        ...

    def set_setpoint(self, shaft: int, setpoint: float) -> None:
        """Change only the goal angle (rad) of one shaft's drive; the cheap call for motion profiles."""
        ...

    def state(self) -> ShaftState:
        """Return angles, speeds and efforts of the shafts at once."""
        ...

    def angles(self) -> NDArray[np.float64]:
        """Return shaft angles, (n,) float, rad; positive closes the hand."""
        return np.array(self.state().angles)

    def speeds(self) -> NDArray[np.float64]:
        """Return shaft speeds, (n,) float, rad/s."""
        return np.array(self.state().speeds)

    def efforts(self) -> NDArray[np.float64]:
        """Return the present clipped efforts of the drives, (n,) float, N m, before back-EMF."""
        return np.array(self.state().efforts)
