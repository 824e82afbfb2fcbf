"""Current and temperatures of a servo as pure functions of effort and time."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

from firmware_emulator.servo.parameters import CURRENT_UNIT_MA, ServoParameters


class CurrentLaw:
    """The current of one servo (register units, unsigned), its constants worked out."""

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
        """Straight lines beyond the recorded curve: end and start, counts, units at the start, units a count."""
        self._at_rest_always = not servo.current_turning_ma and math.isinf(servo.current_fading_counts)
        self._floor = servo.current_floor_ma / CURRENT_UNIT_MA / (servo.stall_torque * servo.duty_per_count)
        self._turning = servo.current_turning_ma / CURRENT_UNIT_MA / (servo.stall_torque * servo.duty_per_count)
        self._begins, self._fades = servo.current_turning_counts**2, servo.current_fading_counts**2

    def at_rest(self, effort: float) -> float:
        """Return the current of a motor held at an effort (N m, sign ignored).

        The recorded curve as far as channels held still (30 mA a count of error below 10 counts, 37 at 20, 43 at 30, 50
        at 46), from there straight to what blocked fingers drew, and on to the reading at full duty, whatever the gain.
        """
        counts = abs(effort) / self._effort_per_count
        if counts <= self._known:
            return self._recorded(counts)
        for end, start, units, slope in self._lines:  # noqa: B007
            if counts <= end:
                break
        return units + (counts - start) * slope

    def turning(self, effort: float, speed: float) -> float:
        """Return the current of a winding's effort (N m) and a speed (counts/s), signs ignored.

        At rest it is `at_rest`. A motor that turns draws more for the same effort, a fast one no more than the floor of
        the static curve: that is what a recorded hand shows, and no theory.
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
    """Return the effort (N m) at which the static current is `current_units`, at most the stall torque.

    The inverse of `CurrentLaw.at_rest`: a blocked servo's reading reaches exactly its goal torque, as homing needs.
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
    """Temperatures of one servo; its sensor, beside the motor, reads their sum."""

    case_c: float
    """Of the case, °C."""
    motor_c: float = 0.0
    """Of the motor above the case, K."""

    def after(self, current_a: float, speed_counts: float, seconds: float, servo: ServoParameters) -> Warmth:
        """Return the temperatures after `seconds` at a current (A, as read) and a speed (counts/s), signs ignored.

        One law at rest and in motion: current and travel warm the motor, its copper losses warm the case.
        """
        case = servo.rest_temperature_c + servo.case_c_per_a2 * current_a**2
        motor = servo.motor_c_per_a * abs(current_a) + servo.motor_c_per_count_per_s * abs(speed_counts)
        return Warmth(
            case + (self.case_c - case) * math.exp(-seconds / servo.cooling_s),
            motor + (self.motor_c - motor) * math.exp(-seconds / servo.motor_s),
        )
