"""Motor drive from a servo's control registers, for each operating mode."""

from __future__ import annotations

import math
from typing import NamedTuple

from firmware_emulator.plant import Drive
from firmware_emulator.servo.electrical import effort_limit
from firmware_emulator.servo.memory import RegisterFile
from firmware_emulator.servo.parameters import ServoParameters

POSITION, SPEED, CURRENT, PWM = range(4)
"""Operating modes, as indices into `model_file.MODES`."""
OFF, ON, DAMPING = range(3)
UNPOWERED = Drive(powered=False)
MOTOR_ACCELERATION = 1e6
"""Acceleration of a profile limited by speed only, counts/s²: beyond the motor's ability."""
LOOP = (
    "torque_enable",
    "mode",
    "acceleration",
    "goal_position",
    "goal_torque",
    "goal_pwm",
    "goal_speed",
    "protection_current",
    "torque_limit",
    "kp",
    "kd",
    "dead_zone_cw",
    "dead_zone_ccw",
)
"""Source registers of `LoopSettings`."""
GOAL = frozenset({"acceleration", "goal_position", "goal_torque", "goal_pwm", "goal_speed"})
"""Subset of `LOOP` that forms a goal."""
FASTEST = 0x7FFF
"""Speed value for no limit, register units."""
FACTORY_DEAD_ZONE = 1
FREE_ANGLES = ((0, 0), (0, 4095))
"""Angle limits without effect: those of a multi-turn servo and of the factory (assumption, needed by homing)."""
ENDLESS_COUNTS = 1e9
"""Distance to the goal in speed mode, counts; effectively infinite."""


class LoopSettings(NamedTuple):
    """Snapshot of the control registers."""

    enable: int
    """0 off, 1 on, 2 damping."""
    mode: int
    """`POSITION`, `SPEED`, `CURRENT` or `PWM`."""
    acceleration: int
    """Acceleration, register units; 0 for the maximum of the motor."""
    position: int
    """Goal position, counts."""
    torque: int
    """Torque limit, signed in current mode, register units; in PWM mode duty, 0.1 % (assumption)."""
    speed: float
    """Goal speed, counts/s."""
    current_limit: int
    """Protection current, register units; bounds the current in all modes but PWM."""
    duty_limit: int
    """Torque limit register, 0.1 % of full duty."""
    gain: float
    """Gain register relative to its factory value; scales the unit's gain in proportion (assumption)."""
    damping: float
    """Damping register relative to its factory value; scales the unit's damping in proportion (assumption)."""
    dead_zone: tuple[int, int]
    """Ignored position error towards higher and towards lower counts, counts."""

    @classmethod
    def of(cls, memory: RegisterFile) -> LoopSettings:
        """Read the settings from the registers."""
        model, get = memory.model, memory.get
        mode = model.mode_codes[min(get("mode"), len(model.mode_codes) - 1)]
        if model.limits_select_motor and not get("min_angle") and not get("max_angle"):
            mode = PWM
        factory_p, factory_d = model.places["kp"].default, model.places["kd"].default
        return cls(
            get("torque_enable"),
            mode,
            get("acceleration"),
            get("goal_position"),
            get("goal_pwm" if mode == PWM else "goal_torque"),
            _speed(memory, mode),
            get("protection_current"),
            get("torque_limit"),
            get("kp") / factory_p if factory_p else 1.0,
            get("kd") / factory_d if factory_d else 1.0,
            (get("dead_zone_cw"), get("dead_zone_ccw")),
        )

    def with_goal_of(self, memory: RegisterFile) -> LoopSettings:
        """Return the result of `of` after writes to `GOAL` registers only; requires torque on."""
        get = memory.get
        return LoopSettings(
            self.enable,
            self.mode,
            get("acceleration"),
            get("goal_position"),
            get("goal_pwm" if self.mode == PWM else "goal_torque"),
            _speed(memory, self.mode),
            self.current_limit,
            self.duty_limit,
            self.gain,
            self.damping,
            self.dead_zone,
        )

    @property
    def current(self) -> int:
        """Bound on the current of the loop, register units."""
        return min(abs(self.torque), self.current_limit)

    def drive(self, setpoint: float, direction: int, servo: ServoParameters) -> Drive:
        """Return the drive for these settings.

        Args:
            setpoint: goal angle, rad; used in position and speed mode only.
            direction: +1 if counts grow as the channel closes, else -1.
            servo: physical parameters.
        """
        if self.enable == OFF:
            return UNPOWERED
        if self.enable == DAMPING:
            return Drive()
        if self.mode == PWM:
            torque = -direction * servo.stall_torque * max(-1.0, min(1.0, self.torque / 1000.0))
            return Drive(torque=torque, limit=abs(torque))
        duty = servo.stall_torque * self.duty_limit / 1000.0
        bound = effort_limit(self.current, servo)
        if self.mode == CURRENT:
            # Positive torque pulls toward lower counts (assumption 4 of the docs; recorded currents agree).
            torque = math.copysign(duty, -direction * self.torque)
            return Drive(torque=torque, limit=duty, current_limit=bound)
        if not bound:
            return Drive(setpoint)
        return Drive(
            setpoint, servo.stiffness * self.gain, servo.damping * self.damping, limit=duty, current_limit=bound
        )

    def differs_by_setpoint(self, other: LoopSettings) -> bool:
        """Return whether both settings follow a setpoint and only the setpoint differs for `drive`."""
        return self.enable == ON and self.mode in (POSITION, SPEED) and self._of_drive == other._of_drive

    @property
    def _of_drive(self) -> tuple[float, ...]:
        return (
            self.enable,
            self.mode,
            self.torque,
            self.current_limit,
            self.duty_limit,
            self.gain,
            self.damping,
        )

    @property
    def has_dead_zone(self) -> bool:
        """Whether small errors are ignored; the factory's dead zone is part of the fitted gains (assumption)."""
        return max(self.dead_zone) > FACTORY_DEAD_ZONE

    def ignores(self, error: float) -> bool:
        """Return whether an error (counts) is within the dead zone."""
        towards_higher, towards_lower = self.dead_zone
        return -towards_lower <= error <= towards_higher

    def limits(self, fastest: float, acceleration_unit: float) -> tuple[float, float] | None:
        """Return speed (counts/s) and acceleration (counts/s²) of the profile, or None if neither limits the motor.

        Args:
            fastest: no-load speed of the motor, counts/s.
            acceleration_unit: unit of the acceleration register, counts/s².
        """
        speed = abs(self.speed)
        acceleration = acceleration_unit * self.acceleration
        if acceleration == 0.0 and speed >= fastest:
            return None
        return speed, acceleration or MOTOR_ACCELERATION


def _speed(memory: RegisterFile, mode: int) -> float:
    """Return the goal speed, counts/s."""
    speed = memory.get("goal_speed")
    if not speed and memory.model.zero_speed_is_fastest and mode == POSITION:
        speed = FASTEST
    return memory.model.speed_unit_counts * speed
