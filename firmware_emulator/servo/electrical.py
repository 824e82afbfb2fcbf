"""Current and temperature of a servo as pure functions of effort and time."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

from firmware_emulator.servo.parameters import CURRENT_UNIT_MA, RECORDED_COUNTS, ServoParameters


def static_current(effort: float, servo: ServoParameters) -> float:
    """Return the current (register units, unsigned) of a motor held at this effort (N m, sign ignored).

    The recorded curve as far as it was recorded (30 mA per count of error below 10 counts, 37 at 20, 43 at 30, 50 at
    46), and from there straight to the reading at full duty, whatever the gain.
    """
    return current_curve(servo)(effort)


def current_curve(servo: ServoParameters) -> Callable[[float], float]:
    """Return `static_current` of one servo as a function of effort, its constants worked out."""
    effort_per_count = servo.stall_torque * servo.duty_per_count
    floor, largest_rise, knee = servo.current_floor_ma, servo.current_rise_ma, servo.current_knee_counts**2

    def recorded(counts: float) -> float:
        square = counts * counts
        rise = largest_rise * square / (square + knee)
        return counts * (floor + rise) / CURRENT_UNIT_MA

    start, beyond = recorded(RECORDED_COUNTS), 1.0 / servo.duty_per_count - RECORDED_COUNTS
    gain = servo.full_duty_units - start

    def current(effort: float) -> float:
        counts = abs(effort) / effort_per_count
        if counts <= RECORDED_COUNTS:
            return recorded(counts)
        return start + (counts - RECORDED_COUNTS) / beyond * gain

    return current


def turning_current(servo: ServoParameters) -> Callable[[float, float], float]:
    """Return the current (register units, unsigned) of a winding's effort (N m) and a speed (counts/s), signs ignored.

    At rest it is `static_current`. A motor that turns draws more for the same effort, a fast one no more than the floor
    of the static curve: that is what a recorded hand shows, and no theory.
    """
    at_rest = current_curve(servo)
    if not servo.current_turning_ma and math.isinf(servo.current_fading_counts):
        return lambda effort, _speed: at_rest(effort)
    floor = servo.current_floor_ma / CURRENT_UNIT_MA / (servo.stall_torque * servo.duty_per_count)
    turning = servo.current_turning_ma / CURRENT_UNIT_MA / (servo.stall_torque * servo.duty_per_count)
    begins, fades = servo.current_turning_counts**2, servo.current_fading_counts**2

    def current(effort: float, speed: float) -> float:
        effort, square = abs(effort), speed * speed
        above = at_rest(effort) - floor * effort + turning * effort * square / (square + begins)
        return floor * effort + above / (1.0 + square / fades)

    return current


@lru_cache(maxsize=512)
def effort_limit(current_units: int, servo: ServoParameters) -> float:
    """Return the effort (N m) at which the static current is `current_units`, at most the stall torque.

    The inverse of `static_current`, so that a blocked servo's reading reaches exactly its goal torque, as homing needs.
    """
    current = current_curve(servo)
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
