"""What a servo's control registers ask of its motor, mode by mode."""

from __future__ import annotations

import math
from typing import NamedTuple

from firmware_emulator.plant import Drive
from firmware_emulator.servo.electrical import effort_limit
from firmware_emulator.servo.memory import RegisterFile
from firmware_emulator.servo.parameters import ServoParameters

POSITION, SPEED, CURRENT, PWM = range(4)
"""Places in `model_file.MODES`."""
OFF, ON, DAMPING = range(3)
UNPOWERED = Drive(powered=False)
MOTOR_ACCELERATION = 1e6
"""Acceleration of a profile that only its speed limits, counts/s²: above what the motor can follow."""
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
"""Registers that `LoopSettings` is read from."""
GOAL = frozenset({"acceleration", "goal_position", "goal_torque", "goal_pwm", "goal_speed"})
"""Those of them that a goal consists of."""
FASTEST = 0x7FFF
"""Speed that stands for no limit, register units."""
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
    """`POSITION`, `SPEED`, `CURRENT` or `PWM`."""
    acceleration: int
    """Register units, 0 = as fast as the motor can."""
    position: int
    """Counts."""
    torque: int
    """Register units; a limit of position and speed, signed for the current; 0.1 % duty in PWM mode (assumption)."""
    speed: float
    """Counts/s."""
    current_limit: int
    """Protection current, register units: bounds every mode that controls current."""
    duty_limit: int
    """Torque limit register, 0.1 % of full duty."""
    gain: float
    """Gain register over its factory value, for which the unit's own gain stands (the proportion is an assumption)."""
    damping: float
    """Damping register, as the gain."""
    dead_zone: tuple[int, int]
    """Counts of error towards higher and towards lower counts that are left alone."""

    @classmethod
    def of(cls, memory: RegisterFile) -> LoopSettings:
        """Read them from the registers."""
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
        """Return what `of` would when nothing but `GOAL` was written since; the torque is on."""
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
        return Drive(
            setpoint, servo.stiffness * self.gain, servo.damping * self.damping, limit=duty, current_limit=bound
        )

    def differs_by_setpoint(self, other: LoopSettings) -> bool:
        """Return whether `drive` of both, at one setpoint, is the same, and has a setpoint."""
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
        """Whether small errors are left alone; the factory's single count is in the fitted gains (assumption)."""
        return max(self.dead_zone) > FACTORY_DEAD_ZONE

    def ignores(self, error: float) -> bool:
        """Return whether an error (counts) lies in the dead zone."""
        towards_higher, towards_lower = self.dead_zone
        return -towards_lower <= error <= towards_higher

    def limits(self, fastest: float, acceleration_unit: float) -> tuple[float, float] | None:
        """Return speed (counts/s) and acceleration (counts/s²) of the profile, None when neither limits the motor.

        Args:
            fastest: what the motor reaches without load, counts/s.
            acceleration_unit: one unit of the acceleration register, counts/s².
        """
        speed = abs(self.speed)
        acceleration = acceleration_unit * self.acceleration
        if acceleration == 0.0 and speed >= fastest:
            return None
        return speed, acceleration or MOTOR_ACCELERATION


def _speed(memory: RegisterFile, mode: int) -> float:
    """Return the speed (counts/s) that the goal asks for."""
    speed = memory.get("goal_speed")
    if not speed and memory.model.zero_speed_is_fastest and mode == POSITION:
        speed = FASTEST
    return memory.model.speed_unit_counts * speed
