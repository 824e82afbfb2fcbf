"""Trapezoidal motion profile with limited speed and acceleration."""

import math
from typing import NamedTuple


class Segment(NamedTuple):
    """Profile segment of constant acceleration."""

    start: float
    """Start time, s."""
    position: float
    """Position at the start."""
    velocity: float
    """Velocity at the start, per s."""
    acceleration: float
    """Constant acceleration, per s²."""


class Trapezoid(NamedTuple):
    """Planned motion, in the units passed to `plan`."""

    segments: tuple[Segment, ...]
    goal: float
    """Final position, reached at rest."""
    end: float
    """End time, s."""

    def at(self, t: float) -> tuple[float, float]:
        """Return position and velocity at time `t` (s)."""
        if t >= self.end:
            return self.goal, 0.0
        current = self.segments[0]
        for segment in self.segments[1:]:
            if t < segment.start:
                break
            current = segment
        dt = t - current.start
        velocity = current.velocity + current.acceleration * dt
        return current.position + 0.5 * (current.velocity + velocity) * dt, velocity


def plan(
    start: float, position: float, velocity: float, goal: float, *, speed: float, acceleration: float
) -> Trapezoid:
    """Plan the fastest motion from a moving state to rest at `goal`.

    Args:
        start: time at which the motion is in the given state, s.
        position: present position.
        velocity: present velocity, per s; may exceed `speed` or point away from the goal.
        goal: final position.
        speed: largest speed to reach, per s, positive.
        acceleration: rate of change of velocity, per s², positive.

    Returns:
        Ramps and a cruise; overshoots only if the present velocity makes it unavoidable.

    Raises:
        ValueError: a limit is not positive.
    """
    if speed <= 0.0 or acceleration <= 0.0:
        raise ValueError(f"a profile needs positive limits, got speed {speed} and acceleration {acceleration}")
    stopping = velocity * abs(velocity) / (2.0 * acceleration)
    distance = goal - position - stopping
    sign = math.copysign(1.0, distance if distance else velocity)
    # Peak of the triangle that joins the present velocity and rest, cut off at the speed limit.
    peak = math.sqrt(max(0.0, 0.5 * velocity * velocity + acceleration * sign * (goal - position)))
    cruise = sign * min(peak, speed)
    segments: list[Segment] = []
    t, x, v = start, position, velocity
    for target in (cruise, 0.0):
        if target == 0.0:
            # Cruise until the last ramp must start.
            left = goal - x - v * abs(v) / (2.0 * acceleration)
            hold = left / v if v else 0.0
            if hold > 0.0:
                segments.append(Segment(t, x, v, 0.0))
                t, x = t + hold, x + v * hold
        if v != target:
            rate = math.copysign(acceleration, target - v)
            segments.append(Segment(t, x, v, rate))
            duration = (target - v) / rate
            t, x, v = t + duration, x + 0.5 * (v + target) * duration, target
    return Trapezoid(tuple(segments) or (Segment(start, position, 0.0, 0.0),), goal, t)
