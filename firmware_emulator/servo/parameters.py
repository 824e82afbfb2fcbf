"""Physical parameters of a servo model, as data."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from firmware_emulator.servo.models import model_of

COUNTS_PER_TURN = 4096
RAD_PER_COUNT = 2.0 * math.pi / COUNTS_PER_TURN
ACCELERATION_UNIT_COUNTS = 100.0
"""Unit of the acceleration register, counts/s²."""
CURRENT_UNIT_MA = 6.5
"""Nominal unit of a current or torque register, mA."""


LEAST = 1e-3
"""Lower bound of parameters used as divisors, in their own units."""


@dataclass(frozen=True)
class ServoParameters:
    """Parameters of a servo; defaults are those of an HLS3606M at 6 V.

    Unless marked otherwise, defaults are fitted to one physical hand (public logs of June-July 2026,
    TTdragoAlex/tetherIA-aero-hand-open 58b518e). `docs/internals/electronics.md` lists the assumptions.
    """

    model: str = "HLS3606M"
    """Model name, for `models.model_of`; selects the registers."""
    stall_torque: float = 0.588
    """Torque at full duty and standstill, N m (6 kg cm, vendor)."""
    duty_per_count: float = 0.00862
    """Position gain, fraction of full duty per count of error."""
    duty_per_count_per_s: float = 1.21e-4
    """Damping of the motor voltage, fraction of full duty per count/s."""
    no_load_speed_counts: float = 8286.0
    """Speed at full duty without load, counts/s."""
    acceleration_unit_counts: float = ACCELERATION_UNIT_COUNTS
    """Unit of the acceleration register, counts/s²; fits the paper's rise times, below the vendor's value."""
    goal_delay_s: float = 0.0143
    """Dead time from the end of a goal write to its effect, s: 15.3 ms from the host less 1 ms on the wire."""
    loop_period_s: float = 0.001
    """Period of the servo's control loop, s; goals take effect on this grid (assumption)."""
    refresh_period_s: float = 0.002
    """Update period of measurements and of a running profile's setpoint, s (assumption)."""
    turnaround_s: float = 100e-6
    """Time between the end of an instruction and the start of the answer, s (assumption)."""
    current_floor_ma: float = 29.0
    """Static current per count of error for small errors, mA."""
    current_rise_ma: float = 29.5
    """Increase of the static current per count from small to large errors, mA."""
    current_knee_counts: float = 31.0
    """Error at half of `current_rise_ma`, counts."""
    current_known_counts: float = 52.0
    """Largest recorded error of an unblocked channel, counts."""
    current_blocked_counts: float = 75.0
    """Error of fingers at their end stops, counts; knot of the linear current between the recorded curve and full duty.
    Infinity omits the knot."""
    current_blocked_ma: float = 45.0
    """Static current per count of error at `current_blocked_counts`, mA."""
    current_turning_ma: float = 0.0
    """Increase of the current per count for a turning motor, mA."""
    current_turning_counts: float = 150.0
    """Speed at half of `current_turning_ma`, counts/s."""
    current_fading_counts: float = math.inf
    """Speed at which the current above `current_floor_ma` has halved, counts/s; infinite for no effect of speed."""
    full_duty_units: float = 1030.0
    """Current reading of a motor blocked at full duty, register units; homing waits for 950 (assumption)."""
    current_filter_s: float = 0.01
    """Time constant of the current reading, s (assumption: at smaller values the inrush ends a fast homing search)."""
    current_noise_units: float = 1.5
    """Standard deviation of the current reading, register units (7-14 mA)."""
    voltage: float = 6.0
    """Supply voltage, V."""
    rest_temperature_c: float = 39.8
    """Steady-state temperature of an energised servo without load, °C."""
    start_temperature_c: float = 34.0
    """Temperature at time zero, °C."""
    cooling_s: float = 311.0
    """Time constant of the case, s; with the following fields and `rest_temperature_c` fitted to 175 recorded rises,
    the maker's times to 80 °C and the paper's cycles at 1.2 Hz (docs/internals/electronics.md)."""
    case_c_per_a2: float = 2.04
    """Heating of the case by copper losses, K per nominal A²."""
    case_c_per_count_per_s: float = 0.0016
    """Heating of the case by speed, K per count/s: gears, brushes, current peaks."""
    motor_c_per_a2: float = 0.774
    """Heating of the motor above the case by copper losses, K per nominal A²."""
    motor_c_per_a: float = 2.29
    """Heating of the motor above the case by current, K per nominal A."""
    motor_c_per_count_per_s: float = 0.00062
    """Heating of the motor above the case by speed, K per count/s."""
    motor_s: float = 12.9
    """Time constant of the motor, s."""
    reboot_s: float = 0.8
    """Duration without answers after REBOOT, s. Source: transcribed HLS documentation."""
    clamp_goal: bool = False
    """Whether a goal outside the angle limits is clipped; homing requires no clipping (assumption)."""

    def __post_init__(self) -> None:
        if min(self.stall_torque, self.no_load_speed_counts) <= 0.0:
            raise ValueError(
                f"stall torque and no-load speed must be positive, got {self.stall_torque:g} N m and "
                f"{self.no_load_speed_counts:g} counts/s"
            )
        # The squares of these values are divisors; smaller values would underflow.
        for name in ("current_knee_counts", "current_turning_counts", "current_fading_counts", "cooling_s", "motor_s"):
            if getattr(self, name) < LEAST:
                raise ValueError(f"{name} must be at least {LEAST:g}, got {getattr(self, name):g}")
        if not self.current_filter_s > 0.0:
            raise ValueError(f"the current's time constant must be positive, got {self.current_filter_s:g} s")
        for name, most in (("voltage", 25.5), ("rest_temperature_c", 255.0), ("start_temperature_c", 255.0)):
            if not 0.0 <= getattr(self, name) <= most:
                raise ValueError(f"{name}: a servo's register holds 0 to {most:g}, got {getattr(self, name):g}")
        if not self.current_known_counts < self.current_blocked_counts:
            raise ValueError(
                f"current_blocked_counts must exceed current_known_counts, {self.current_known_counts:g}, got "
                f"{self.current_blocked_counts:g}"
            )
        model_of(self.model)
        if not 0.0 < self.duty_per_count * self.current_known_counts < 1.0:
            raise ValueError(
                f"duty_per_count must be between 0 and 1/{self.current_known_counts:g}, got {self.duty_per_count}: "
                "full duty lies beyond the errors at which currents were recorded (current_known_counts)"
            )

    @classmethod
    def of_model(cls, model: str, **own: float) -> ServoParameters:
        """Return the parameters of a servo model: values of its data sheet, else those of the hand's servo.

        Args:
            model: name, for `models.model_of`.
            own: fields that override the data sheet.

        Raises:
            ValueError: an unknown model or field, or a number out of range.
        """
        try:
            stated: dict[str, Any] = {**model_of(model).physics, **own}
            return cls(model=model, **stated)
        except TypeError as error:
            raise ValueError(f"servo model {model}: {error}") from error

    @property
    def stiffness(self) -> float:
        """Position gain at the shaft, N m/rad."""
        return self.stall_torque * self.duty_per_count / RAD_PER_COUNT

    @property
    def back_emf(self) -> float:
        """Loss of effort per speed by back-EMF, N m s/rad."""
        return self.stall_torque / (self.no_load_speed_counts * RAD_PER_COUNT)

    @property
    def damping(self) -> float:
        """Speed gain at the shaft, N m s/rad."""
        return self.stall_torque * self.duty_per_count_per_s / RAD_PER_COUNT


HLS3606M = ServoParameters()
