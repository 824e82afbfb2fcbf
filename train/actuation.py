"""Actuation between a commanded length and the simulated cable: delay, lag, speed limit, take-up, gain, counts.

The routed hand's actuators follow a command immediately, unlike a physical hand's. Per control period, a target becomes
one control per physics step, and a length becomes a reading. All functions are pure, over NumPy or JAX arrays. The
parameters are drawn once per episode.

Sources: one physical hand, public logs June-July 2026 (TTdragoAlex/tetherIA-aero-hand-open 58b518e): 15-19 ms from
command to motion, closed loop 24-25 ms; take-up: another owner's index (alstar8); radii: paper, regression row of the
thumb cables against the CAD radii (12.64 for 12.49 mm).
"""

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from aero.actuation.arrays import Array, namespace
from aero.actuation.window import COUNTS_PER_TURN
from aero.channels import CABLES
from aero.policy.running import RunSettings
from aero.policy.settings import Row
from aero.policy.task import CHANNELS
from model.units import Unit
from simulator.geometry.winding import SPOOL_RADIUS

REMEMBERED = 3
"""Number of stored targets: enough for delays of up to two control periods."""


def _per_channel(cable: float, abduction: float) -> np.ndarray:
    row = np.full(CHANNELS, abduction)
    row[list(CABLES)] = cable
    return row


SPEED_LIMIT = _per_channel(SPOOL_RADIUS, 1.0) * RunSettings.shaft_speed_rad_s
"""Fastest change of a channel at the servo's no-load speed, (7,), m/s, abduction rad/s."""
COUNT = _per_channel(SPOOL_RADIUS, 1.0) * 2 * np.pi / COUNTS_PER_TURN
"""Change of a channel by one encoder count, (7,), m, abduction rad."""
STALL_FORCE = _per_channel(1.0 / SPOOL_RADIUS, 1.0) * Unit().servos.stall_torque
"""Force of a channel at its servo's stall torque, (7,), N, abduction N m."""

Bounds = tuple[float, float]


@dataclass(frozen=True)
class ActuationRanges:
    """Uniform ranges of one episode's actuation errors; the default is the ideal simulator."""

    lag_s: Bounds = (0.0, 0.0)
    """Time constant of the servo's position loop, s; one draw for all channels."""
    delay_s: Bounds = (0.0, 0.0)
    """Delay from the write to the first motion, s; one draw for all channels, at most two control periods."""
    offset: tuple[Row, Row] = ((0.0,) * CHANNELS,) * 2
    """Lowest and highest excess of a channel over its shaft's reading (take-up, zero error), (7,), m, abduction rad."""
    gain: Bounds = (1.0, 1.0)
    """Ratio of the cable travel to the travel that the map assumes, per channel."""
    speed_limit: bool = False
    """Whether the servo's no-load speed limits a channel; for hands without servos in the physics."""
    slewed: bool = False
    """Whether a command's change per control period is clipped to the servo's speed, as `run-policy` does."""
    counts: bool = False
    """Whether readings are quantised to encoder counts."""


IDEAL = ActuationRanges()
"""Ranges of the released environment."""
SERVOS = ActuationRanges(lag_s=(0.015, 0.040), delay_s=(0.010, 0.030), gain=(0.97, 1.03), speed_limit=True, counts=True)
"""Ranges for servos in front of the routed hand, widened on both sides."""
BUS = ActuationRanges(lag_s=(0.0, 0.020), delay_s=(0.005, 0.030), slewed=True, counts=True)
"""Ranges for servos inside the physics: command delay, and lag of firmware with a motion profile."""

DRAWS = 2 + 2 * CHANNELS
"""Number of uniform draws that `parameters` needs."""


class Parameters(NamedTuple):
    """Actuation parameters of one episode; leading axes are free."""

    lag_s: Array
    """Shape (..., 1), s."""
    delay_s: Array
    """Shape (..., 1), s."""
    offset: Array
    """Shape (..., 7), m, abduction rad."""
    gain: Array
    """Shape (..., 7), dimensionless."""


class ServoState(NamedTuple):
    """State of the servos between two control periods; leading axes are free."""

    sent: Array
    """Latest targets, newest first, (..., REMEMBERED, 7), m, abduction rad."""
    followed: Array
    """Positions of the servos' control loops, (..., 7), m, abduction rad."""


def check(ranges: ActuationRanges, period_s: float) -> None:
    """Raise for ranges that cannot be simulated.

    Raises:
        ValueError: an empty range, a negative time, a delay over `REMEMBERED - 1` periods, a gain of 0 or less.
    """
    for field in fields(ranges):
        value = getattr(ranges, field.name)
        if isinstance(value, tuple) and not np.all(np.less_equal(*value)):
            raise ValueError(f"{field.name} must be (low, high) with low <= high, got {value}")
    longest = (REMEMBERED - 1) * period_s
    if ranges.lag_s[0] < 0 or ranges.delay_s[0] < 0 or ranges.delay_s[1] > longest or ranges.gain[0] <= 0:
        raise ValueError(f"lag must be >= 0, delay within [0, {longest}] s and gain > 0, got {ranges}")


def parameters(ranges: ActuationRanges, uniform: Array) -> Parameters:
    """Return the parameters for draws `uniform` from [0, 1], shape (..., DRAWS)."""
    low, high = np.array(ranges.offset)
    offsets, gains = uniform[..., 2 : 2 + CHANNELS], uniform[..., 2 + CHANNELS :]
    return Parameters(
        lag_s=_between(ranges.lag_s, uniform[..., 0:1]),
        delay_s=_between(ranges.delay_s, uniform[..., 1:2]),
        offset=low + (high - low) * offsets,
        gain=_between(ranges.gain, gains),
    )


def at_rest(target: Array) -> ServoState:
    """Return servos settled at `target` (..., 7)."""
    return ServoState(namespace(target).stack([target] * REMEMBERED, axis=-2), target)


def drive(
    servo: ServoState,
    target: Array,
    parameters: Parameters,
    nominal: Array,
    *,
    steps: int,
    step_s: float,
    ranges: ActuationRanges,
) -> tuple[ServoState, Array]:
    """Track a new target for one control period.

    Args:
        servo: state before the period.
        target: (..., 7) lengths written at the start of the period.
        parameters: actuation of this episode.
        nominal: (7,) lengths about which gains deviate.
        steps: physics steps a period.
        step_s: length of a physics step, s.
        ranges: flags for slewed commands and for the servo's speed limit.

    Returns:
        The servos after the period and the controls of its physics steps, (..., steps, 7).
    """
    xp = namespace(target)
    if ranges.slewed:
        last, most = servo.sent[..., 0, :], SPEED_LIMIT * step_s * steps
        target = last + xp.clip(target - last, -most, most)
    sent = xp.concatenate([target[..., None, :], servo.sent[..., :-1, :]], axis=-2)
    share = 1.0 - xp.exp(-step_s / xp.maximum(parameters.lag_s, 1e-9))
    followed, controls = servo.followed, []
    for step in range(steps):
        arrived = _arrived(sent, parameters.delay_s, step, steps, step_s)
        change = share * (arrived - followed)
        if ranges.speed_limit:
            change = xp.clip(change, -SPEED_LIMIT * step_s, SPEED_LIMIT * step_s)
        followed = followed + change
        controls.append(nominal + parameters.gain * (followed - nominal) + parameters.offset)
    return ServoState(sent, followed), xp.stack(controls, axis=-2)


def read(lengths: Array, parameters: Parameters, nominal: Array, in_counts: bool) -> Array:
    """Return the encoder readings for simulated `lengths` (..., 7)."""
    xp = namespace(lengths)
    spooled = nominal + (lengths - parameters.offset - nominal) / parameters.gain
    return xp.floor(spooled / COUNT) * COUNT if in_counts else spooled


def _arrived(sent: Array, delay_s: Array, step: int, steps: int, step_s: float) -> Array:
    """Return the mean delayed target over one physics step, each target weighted by its valid part of the step."""
    xp = namespace(sent)
    total, later = 0.0 * sent[..., 0, :], 0.0 * delay_s
    for age in range(REMEMBERED):
        valid_from = delay_s / step_s - age * steps
        until_now = xp.clip(step + 1 - valid_from, 0.0, 1.0)
        share = (until_now if age < REMEMBERED - 1 else 0.0 * delay_s + 1.0) - later
        total, later = total + share * sent[..., age, :], later + share
    return total


def _between(limits: Bounds, uniform: Array) -> Array:
    low, high = limits
    return low + (high - low) * uniform
