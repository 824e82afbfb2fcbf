"""Test bench of seven bare shafts: the smallest plant, for tests of the electronics and for exploring homing.

Each shaft has inertia, back-EMF, Coulomb friction and two elastic end stops. Integration is semi-implicit with a fixed
substep; friction and damping are implicit, so a shaft at rest stays at rest and every parameter set is stable.
"""

import math
from dataclasses import dataclass

from firmware_emulator.plant import SHAFTS, Drive, Plant, ShaftState

SUBSTEP_S = 0.001
"""Longest integration step."""


@dataclass(frozen=True)
class BenchShaft:
    """Mechanical load on one servo."""

    inertia: float = 7.5e-4
    """Reflected rotor inertia, kg m²."""
    back_emf: float = 0.0463
    """Torque lost per speed while powered, N m s/rad: stall torque 0.588 N m over 12.71 rad/s."""
    friction: float = 0.02
    """Coulomb friction, N m."""
    stop_low: float = -math.inf
    """Angle of the stop on the opening side, rad."""
    stop_high: float = math.inf
    """Angle of the stop on the closing side, rad."""
    stop_stiffness: float = 60.0
    """Stiffness of both stops, N m/rad."""
    stop_damping: float = 0.3
    """Damping while in contact, N m s/rad."""
    spring: float = 0.0
    """Constant opening torque, N m."""


class Bench(Plant):
    """Seven `BenchShaft`s as a `Plant`."""

    def __init__(
        self,
        shafts: BenchShaft | tuple[BenchShaft, ...] = BenchShaft(),
        *,
        angles: tuple[float, ...] = (0.0,) * SHAFTS,
    ) -> None:
        """Put the shafts (one description for all, or seven in command order) at rest at `angles` (rad)."""
        self._shafts = (shafts,) * SHAFTS if isinstance(shafts, BenchShaft) else tuple(shafts)
        if len(self._shafts) != SHAFTS or len(angles) != SHAFTS:
            raise ValueError(f"a bench has {SHAFTS} shafts, got {len(self._shafts)} and {len(angles)} angles")
        self._time = 0.0
        self._angles = [float(angle) for angle in angles]
        self._speeds = [0.0] * SHAFTS
        self._drives = [Drive(powered=False)] * SHAFTS
        self._setpoints = [0.0] * SHAFTS

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._time

    def advance_to(self, t: float) -> None:
        """Integrate to exactly `t` (s)."""
        span = t - self._time
        if span <= 0.0:
            return
        steps = math.ceil(span / SUBSTEP_S - 1e-9)
        for shaft in range(SHAFTS):
            self._advance_shaft(shaft, steps, span / steps)
        self._time = t

    def _advance_shaft(self, shaft: int, steps: int, dt: float) -> None:
        body, drive = self._shafts[shaft], self._drives[shaft]
        angle, speed = self._angles[shaft], self._speeds[shaft]
        back_emf = body.back_emf if drive.powered else 0.0
        stiffness, setpoint, damping = drive.stiffness, self._setpoints[shaft], drive.damping
        torque, limit, current_limit = drive.torque, drive.limit, drive.current_limit
        low, high = body.stop_low, body.stop_high
        grip = body.friction / body.inertia * dt
        for _ in range(steps):
            # Damping terms are integrated implicitly, so that stiff gains cannot ring numerically.
            load = torque + stiffness * (setpoint - angle) - damping * speed
            viscous = back_emf
            if load > limit:
                load = limit
            elif load < -limit:
                load = -limit
            else:
                load += damping * speed
                viscous += damping + stiffness * dt
            winding = load - viscous * speed
            if winding > current_limit or winding < -current_limit:
                load, viscous = math.copysign(current_limit, winding), 0.0
            load -= body.spring
            if angle > high or angle < low:
                load += body.stop_stiffness * ((high if angle > high else low) - angle)
                viscous += body.stop_damping + body.stop_stiffness * dt
            speed = (speed + load / body.inertia * dt) / (1.0 + viscous / body.inertia * dt)
            if abs(speed) <= grip:
                speed = 0.0
            else:
                speed -= math.copysign(grip, speed)
            angle += speed * dt
        self._angles[shaft], self._speeds[shaft] = angle, speed

    def drive(self, shaft: int, drive: Drive) -> None:
        """Replace the drive of one shaft."""
        self._drives[shaft] = drive
        self._setpoints[shaft] = drive.setpoint

    def set_setpoint(self, shaft: int, setpoint: float) -> None:
        """Change only the goal angle (rad) of one shaft's drive."""
        self._setpoints[shaft] = setpoint

    def state(self) -> ShaftState:
        """Return angles, speeds and efforts of the shafts at once."""
        efforts = map(Drive.effort, self._drives, self._setpoints, self._angles, self._speeds)
        return ShaftState([*self._angles], [*self._speeds], [*efforts])
