"""Current and temperature of a servo as pure functions of effort and time."""

from __future__ import annotations

import math
from functools import lru_cache

from firmware_emulator.servo.parameters import CURRENT_UNIT_MA, ServoParameters


class CurrentLaw:
    """The current of one servo (register units, unsigned), its constants worked out."""

    def __init__(self, servo: ServoParameters) -> None:
        self._effort_per_count = servo.stall_torque * servo.duty_per_count
        self._floor_ma, self._rise_ma = servo.current_floor_ma, servo.current_rise_ma
        self._knee = servo.current_knee_counts**2
        self._known = servo.current_known_counts
        self._start = self._recorded(self._known)
        self._beyond = 1.0 / servo.duty_per_count - self._known
        self._gain = servo.full_duty_units - self._start
        self._at_rest_always = not servo.current_turning_ma and math.isinf(servo.current_fading_counts)
        self._floor = servo.current_floor_ma / CURRENT_UNIT_MA / (servo.stall_torque * servo.duty_per_count)
        self._turning = servo.current_turning_ma / CURRENT_UNIT_MA / (servo.stall_torque * servo.duty_per_count)
        self._begins, self._fades = servo.current_turning_counts**2, servo.current_fading_counts**2

    def at_rest(self, effort: float) -> float:
        """Return the current of a motor held at an effort (N m, sign ignored).

        The recorded curve as far as it was recorded (30 mA per count of error below 10 counts, 37 at 20, 43 at 30, 50
        at 46), and from there straight to the reading at full duty, whatever the gain.
        """
        counts = abs(effort) / self._effort_per_count
        if counts <= self._known:
            return self._recorded(counts)
        return self._start + (counts - self._known) / self._beyond * self._gain

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


def temperature_after(
    temperature_c: float, mean_square_a2: float, seconds: float, servo: ServoParameters, *, speed_counts: float = 0.0
) -> float:
    """Return the temperature (°C) after `seconds` with a mean square current (A²) and a mean speed (counts/s)."""
    heating = servo.heating_c_per_s * mean_square_a2 / (mean_square_a2 + servo.heating_knee_a**2)
    heating += servo.heating_c_per_count * abs(speed_counts)
    final = servo.rest_temperature_c + heating * servo.cooling_s
    return final + (temperature_c - final) * math.exp(-seconds / servo.cooling_s)
