"""Current and temperatures of a servo, as pure functions of effort and time."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

from firmware_emulator.servo.parameters import CURRENT_UNIT_MA, ServoParameters


class CurrentLaw:
    """Current of one servo (register units, unsigned), with precomputed constants."""

    def __init__(self, servo: ServoParameters) -> None:
        self._effort_per_count = servo.stall_torque * servo.duty_per_count
        self._floor_ma, self._rise_ma = servo.current_floor_ma, servo.current_rise_ma
        self._knee = servo.current_knee_counts**2
        self._known = servo.current_known_counts
        blocked, full = servo.current_blocked_counts, 1.0 / servo.duty_per_count
        knots = [(self._known, self._recorded(self._known))]
        if blocked < full:
            knots.append((blocked, blocked * servo.current_blocked_ma / CURRENT_UNIT_MA))
        knots.append((full, servo.full_duty_units))
        self._lines = [
            (end, start, units, (last - units) / (end - start)) for (start, units), (end, last) in pairwise(knots)
        ]
        """Linear segments beyond the recorded curve: end and start (counts), units at the start, units per count."""
        self._at_rest_always = not servo.current_turning_ma and math.isinf(servo.current_fading_counts)
        self._floor = servo.current_floor_ma / CURRENT_UNIT_MA / (servo.stall_torque * servo.duty_per_count)
        self._turning = servo.current_turning_ma / CURRENT_UNIT_MA / (servo.stall_torque * servo.duty_per_count)
        # Products, because a power of a large parameter raises OverflowError.
        self._begins = servo.current_turning_counts * servo.current_turning_counts
        self._fades = servo.current_fading_counts * servo.current_fading_counts

    def at_rest(self, effort: float) -> float:
        """Return the current of a motor held at an effort (N m, sign ignored).

        Up to `current_known_counts` the curve recorded on channels at rest (30 mA per count of error below 10 counts,
        37 at 20, 43 at 30, 50 at 46); then linear to the current of blocked fingers and on to that at full duty.
        """
        counts = abs(effort) / self._effort_per_count
        if counts <= self._known:
            return self._recorded(counts)
        for end, start, units, slope in self._lines:  # noqa: B007
            if counts <= end:
                break
        return units + (counts - start) * slope

    def turning(self, effort: float, speed: float) -> float:
        """Return the current at a winding effort (N m) and a speed (counts/s), signs ignored.

        At speed 0 the result equals `at_rest`. A turning motor draws more at equal effort; at high speed the current
        falls to the floor of the static curve. Empirical, from recordings of one hand.
        """
        at_rest = self.at_rest(effort)
        if self._at_rest_always:
            return at_rest
        effort, square = abs(effort), speed * speed
        floor = self._floor * effort
        above = at_rest - floor + self._turning * effort * square / (square + self._begins)
        return floor + above / (1.0 + square / self._fades)

    def _recorded(self, counts: float) -> float:
        square = counts * counts
        rise = self._rise_ma * square / (square + self._knee)
        return counts * (self._floor_ma + rise) / CURRENT_UNIT_MA


@lru_cache(maxsize=512)
def effort_limit(current_units: int, servo: ServoParameters) -> float:
    """Return the effort (N m) with a static current of `current_units`, at most the stall torque.

    Inverse of `CurrentLaw.at_rest`: a blocked servo's reading reaches exactly its goal torque, as homing requires.
    """
    current = CurrentLaw(servo).at_rest
    if current(servo.stall_torque) <= current_units:
        return servo.stall_torque
    low, high = 0.0, servo.stall_torque
    while high - low > 1e-12:
        middle = 0.5 * (low + high)
        if current(middle) < current_units:
            low = middle
        else:
            high = middle
    return high


class Warmth(NamedTuple):
    """Temperatures of one servo; the sensor, beside the motor, reads their sum."""

    case_c: float
    """Temperature of the case, °C."""
    motor_c: float = 0.0
    """Temperature of the motor above the case, K."""

    def after(self, current_a: float, speed_counts: float, seconds: float, servo: ServoParameters) -> Warmth:
        """Return the temperatures after `seconds` at a measured current (A) and a speed (counts/s), signs ignored.

        Copper losses and speed heat motor and case, each with its own time constant, both at rest and in motion.
        """
        square, speed = current_a**2, abs(speed_counts)
        case = servo.rest_temperature_c + servo.case_c_per_a2 * square + servo.case_c_per_count_per_s * speed
        motor = (
            servo.motor_c_per_a2 * square + servo.motor_c_per_a * abs(current_a) + servo.motor_c_per_count_per_s * speed
        )
        return Warmth(
            case + (self.case_c - case) * math.exp(-seconds / servo.cooling_s),
            motor + (self.motor_c - motor) * math.exp(-seconds / servo.motor_s),
        )
