"""What a servo's control registers ask of its motor, mode by mode."""

from __future__ import annotations

import math
from typing import NamedTuple

from firmware_emulator.plant import Drive
from firmware_emulator.servo.electrical import effort_limit
from firmware_emulator.servo.memory import RegisterFile
from firmware_emulator.servo.parameters import SPEED_UNIT_COUNTS, ServoParameters

POSITION, SPEED, CURRENT, PWM = range(4)
OFF, ON, DAMPING = range(3)
UNPOWERED = Drive(powered=False)
MOTOR_ACCELERATION = 1e6
"""Acceleration of a profile that only its speed limits, counts/s²: above what the motor can follow."""
FACTORY_GAIN = 32
"""Factory value of both gain registers (assumption); the effect of others is in proportion to it (assumption)."""
FACTORY_DEAD_ZONE = 1
FREE_ANGLES = ((0, 0), (0, 4095))
"""Angle limits that bound nothing: those of a multi-turn servo, and the factory's (assumption: homing needs it)."""
ENDLESS_COUNTS = 1e9
"""Goal of a motion without end, for the speed mode."""


class LoopSettings(NamedTuple):
    """The control registers at one moment."""

    enable: int
    """0 off, 1 on, 2 damping."""
    mode: int
    """0 position, 1 speed, 2 current, 3 PWM."""
    acceleration: int
    """Register units, 0 = as fast as the motor can."""
    position: int
    """Counts."""
    torque: int
    """Register units; a limit in modes 0 and 1, signed in mode 2; 0.1 % duty in mode 3 (assumption)."""
    speed: int
    """Register units."""
    current_limit: int
    """Protection current, register units: bounds every mode that controls current."""
    duty_limit: int
    """Torque limit register, 0.1 % of full duty."""
    kp: int
    """Gain register; the unit's own gain stands for the factory value."""
    kd: int
    """Damping register; the unit's own damping stands for the factory value."""
    dead_zone: tuple[int, int]
    """Counts of error towards higher and towards lower counts that are left alone."""

    @classmethod
    def of(cls, memory: RegisterFile) -> LoopSettings:
        """Read them from the registers."""
        return cls(
            memory.get("torque_enable"),
            memory.get("mode"),
            memory.get("acceleration"),
            memory.get("goal_position"),
            memory.get("goal_torque"),
            memory.get("goal_speed"),
            memory.get("protection_current"),
            memory.get("torque_limit"),
            memory.get("kp"),
            memory.get("kd"),
            (memory.get("dead_zone_cw"), memory.get("dead_zone_ccw")),
        )

    @property
    def current(self) -> int:
        """Largest current the loop may ask for, register units."""
        return min(abs(self.torque), self.current_limit)

    def drive(self, setpoint: float, direction: int, servo: ServoParameters) -> Drive:
        """Return the drive for these settings.

        Args:
            setpoint: goal angle for the modes that have one, rad.
            direction: +1 when counts grow as the channel closes.
            servo: the servo's physics.
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
            # Positive torque pulls toward lower counts (assumption 4 of the docs; the recorded currents agree).
            torque = math.copysign(duty, -direction * self.torque)
            return Drive(torque=torque, limit=duty, current_limit=bound)
        if not bound:
            return Drive(setpoint)
        stiffness, damping = servo.stiffness * self.kp / FACTORY_GAIN, servo.damping * self.kd / FACTORY_GAIN
        return Drive(setpoint, stiffness, damping, limit=duty, current_limit=bound)

    @property
    def has_dead_zone(self) -> bool:
        """Whether small errors are left alone; the factory's single count is in the fitted gains (assumption)."""
        return max(self.dead_zone) > FACTORY_DEAD_ZONE

    def ignores(self, error: float) -> bool:
        """Return whether an error (counts) lies in the dead zone."""
        towards_higher, towards_lower = self.dead_zone
        return -towards_lower <= error <= towards_higher

    def limits(self, servo: ServoParameters) -> tuple[float, float] | None:
        """Return speed (counts/s) and acceleration (counts/s²) of the profile, None when neither limits the motor."""
        speed = SPEED_UNIT_COUNTS * abs(self.speed)
        acceleration = servo.acceleration_unit_counts * self.acceleration
        if acceleration == 0.0 and speed >= servo.no_load_speed_counts:
            return None
        return speed, acceleration or MOTOR_ACCELERATION
