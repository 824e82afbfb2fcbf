"""Unit as a model for calibration: its free numbers, and its prediction by replays through the whole chain."""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence, Set
from concurrent.futures import Executor
from dataclasses import dataclass
from itertools import cycle, islice
from typing import Any

import numpy as np

from aero.channels import CABLES, FINGERS, THUMB, Channel, Joint
from aero.firmware import DEFAULT_FIRMWARE
from aero.floats import Floats
from aero.protocol import MAX_CODE
from model.units import Unit
from train.identification.trace import Trace
from train.identification.trace_replay import READ, replay

Residuals = list[Floats]
"""Predicted minus recorded counts, (m, 7) per trace."""

STEP = 0.3
"""Step of the finite differences in units of `Free.spread`; large, as counts are integers and friction has kinks."""


@dataclass(frozen=True)
class Free:
    """Free number of a fit, relative to the starting unit and initially zero."""

    name: str
    """Changed field, `section.field`."""
    indices: tuple[int, ...]
    """Changed entries of the field; empty if the field is scalar."""
    channels: tuple[Channel, ...]
    spread: float
    """Standard deviation of the prior."""
    additive: bool = False
    """True if the number is added to the field; otherwise its exponential is a factor."""
    step: float = STEP
    """Step of the finite differences in units of the spread."""


ALL = tuple(Channel)
SPRUNG: tuple[tuple[Channel, tuple[int, ...]], ...] = (
    *((finger, (3 * finger,)) for finger in FINGERS),
    *((finger, (3 * finger + 1, 3 * finger + 2)) for finger in FINGERS),
    (Channel.THUMB_CMC_FLEXION, (Joint.THUMB_CMC,)),
    (Channel.THUMB_FLEXOR, (Joint.THUMB_MCP, Joint.THUMB_IP)),
)
"""Joints whose springs load a cable, by channel. The knuckle is separate because it closes first, so its springs act in
another part of the stroke."""
JOINTS: tuple[tuple[Channel, tuple[int, ...]], ...] = (
    *((finger, (3 * finger, 3 * finger + 1, 3 * finger + 2)) for finger in FINGERS),
    (Channel.THUMB_ABDUCTION, (Joint.THUMB_ABDUCTION,)),
    *SPRUNG[-2:],
)
PHASES_S = (0.0, 0.0025, 0.005, 0.0075)
"""Candidate phases of a recording relative to the board's 10 ms telemetry grid, s."""


TAKE_UP, CLOSED_STOP = "hand.cable_take_up", "hand.closed_stop"


def _each(name: str, spread: float, channels: tuple[Channel, ...] = ALL) -> tuple[Free, ...]:
    return tuple(Free(name, (channel,), (channel,), spread) for channel in channels)


def _springs(name: str, spread: float) -> tuple[Free, ...]:
    return tuple(Free(name, joints, (channel,), spread) for channel, joints in SPRUNG)


FREE: tuple[Free, ...] = (
    Free("servos.goal_delay_s", (), ALL, 0.15),
    Free("servos.duty_per_count", (), ALL, 0.15),
    Free("servos.duty_per_count_per_s", (), ALL, 0.4),
    Free("servos.no_load_speed_counts", (), ALL, 0.06),
    *_each("hand.rotor_inertia", 0.3),
    *_each("hand.cable_friction", 0.5, CABLES),
    *_each("hand.spool_friction", 0.7),
    *_springs("hand.spring_open", 0.4),
    *_springs("hand.spring_rise", 0.6),
    # A short step, because the tension of a taut cable changes within 0.1 mm.
    *(Free(TAKE_UP, (channel,), (channel,), 1e-3, additive=True, step=0.1) for channel in CABLES),
    Free("hand.supply_sag", (), ALL, 0.7),
    Free(CLOSED_STOP, tuple(range(12)), FINGERS, 0.01),
    Free("hand.abduction_winding", (0,), THUMB, 0.3),
    Free("hand.abduction_winding", (1,), THUMB, 0.3),
)
"""Free numbers of a calibration: logarithms of factors, or additive values in SI units. `hand.spring_rise` is the
increase of the spring torque from the open to the closed hand."""


KEPT: tuple[Free, ...] = (
    Free("servos.stall_torque", (), ALL, 0.1),
    Free("hand.supply_ratio", (), ALL, 0.1),
    Free("hand.cable_compliance", (), ALL, 0.4),
    *_each("hand.winding_scale", 0.02, tuple(CABLES)),
    *(Free("hand.joint_friction", joints, (channel,), 0.7) for channel, joints in JOINTS),
    *(Free("hand.joint_damping", joints, (channel,), 0.7) for channel, joints in JOINTS),
)
"""Fixed numbers with the spread of their error; it widens the intervals. Encoders cannot separate them from `FREE`."""
MOVED = 0.01
"""Threshold of a channel's commanded range, fraction of the window; above it the recording excites the channel."""
STOPPED = 0.9
"""Threshold of a finger's command, fraction of the window; above it the finger may reach its end stop (recorded:
0.976)."""


def excited(traces: Sequence[Trace]) -> frozenset[Channel]:
    """Return the channels that move in any of the recordings."""
    swept = np.max([np.ptp(trace.codes, axis=0) for trace in traces], axis=0)
    return frozenset(channel for channel in Channel if swept[channel] > MOVED * MAX_CODE)


def felt_otherwise(traces: Sequence[Trace]) -> dict[str, frozenset[Channel]]:
    """Return the channels with a determined take-up or closed stop, by field name.

    Take-up needs motion or the current of a resting open hand; the closed stop needs a finger closed to its stop.
    """
    closed = np.max([trace.codes.max(axis=0) for trace in traces], axis=0) > STOPPED * MAX_CODE
    pulled = np.any([trace.beyond().any(axis=0) for trace in traces], axis=0)
    return {
        TAKE_UP: excited(traces) | {channel for channel in CABLES if pulled[channel]},
        CLOSED_STOP: frozenset(channel for channel in FINGERS if closed[channel]),
    }


def identifiable_parameters(
    free: Sequence[Free], moved: Set[Channel], otherwise: Mapping[str, Set[Channel]]
) -> tuple[Free, ...]:
    """Return the free numbers that recordings with the `moved` channels determine; `otherwise` overrides these by name.

    A number with separate entries per channel is reduced to the determined channels. A number shared by channels
    requires all of them, so that fitting one channel does not change another.
    """
    told = []
    for number in free:
        each, rest = divmod(len(number.indices), len(number.channels))
        felt = otherwise.get(number.name, moved)
        channels = tuple(channel for channel in number.channels if channel in felt)
        if len(channels) == len(number.channels):
            told.append(number)
        elif channels and each and not rest:
            own = zip(number.channels, range(0, len(number.indices), each), strict=True)
            kept = tuple(i for channel, at in own if channel in felt for i in number.indices[at : at + each])
            told.append(dataclasses.replace(number, indices=kept, channels=channels))
    return tuple(told)


@dataclass(frozen=True)
class UnitModel:
    """Unit with free numbers, and the traces that it predicts."""

    start: Unit
    """Starting unit; all free numbers are zero."""
    traces: tuple[Trace, ...]
    firmware: str = DEFAULT_FIRMWARE
    pool: Executor | None = None
    """Executor for the replays; None for this process."""
    free: tuple[Free, ...] = FREE
    phases_s: tuple[float, ...] = PHASES_S
    replayed: Callable[[Trace], None] = lambda _trace: None
    """Called after each replay with its trace."""

    def unit(self, x: Floats) -> Unit:
        """Return the unit for the free numbers (p,)."""
        return apply(self.start, self.free, x)

    def numbers(self, x: Floats) -> dict[str, Floats]:
        """Return the fields of the unit for the free numbers (p,), by `section.field`."""
        return numbers_at(self.start, self.free, x)

    def residuals(self, x: Sequence[Floats], phases_s: Sequence[float]) -> Residuals:
        """Return the residuals of each trace, for free numbers (p,) and a phase per trace.

        One call may request several rounds of all traces in sequence, which keeps every process busy.
        """
        units = [self.unit(numbers) for numbers in x]
        each = self.pool.map if self.pool else map
        missed = []
        traces = list(islice(cycle(self.traces), len(units)))
        found = each(_misses, traces, units, [self.firmware] * len(units), phases_s)
        for trace, one in zip(traces, found, strict=True):
            missed.append(one)
            self.replayed(trace)
        return missed


Tables = dict[str, dict[str, Any]]
"""Fields of a unit by section."""


def apply(unit: Unit, free: Sequence[Free], x: Floats) -> Unit:
    """Return the unit with its free numbers changed by `x`, (len(free),) float; see `Free`.

    Raises:
        ValueError: the numbers are physically impossible.
    """
    tables = _moved(unit, free, x)
    servos = dataclasses.replace(unit.servos, **tables["servos"])
    mechanics = dataclasses.replace(unit.hand, **tables["hand"])
    return dataclasses.replace(unit, servos=servos, hand=mechanics)


def _moved(unit: Unit, free: Sequence[Free], x: Floats) -> Tables:
    tables = {"servos": dataclasses.asdict(unit.servos), "hand": _with_rise(dataclasses.asdict(unit.hand))}
    for number, value in zip(free, x.tolist(), strict=True):
        section, field = number.name.split(".")
        table = tables[section]
        gain, factor = (value, 1.0) if number.additive else (0.0, math.exp(value))
        if number.indices:
            table[field] = tuple(
                gain + factor * entry if i in number.indices else entry for i, entry in enumerate(table[field])
            )
        else:
            table[field] = gain + factor * table[field]
    return {**tables, "hand": _without_rise(tables["hand"])}


def numbers(unit: Unit) -> dict[str, Floats]:
    """Return a unit's fields that calibration can change, arrays by `section.field`."""
    return numbers_at(unit, (), np.zeros(0))


def numbers_at(unit: Unit, free: Sequence[Free], x: Floats) -> dict[str, Floats]:
    """Return the calibrated fields of `unit` changed by `x`, (len(free),), without a check of their validity.

    An interval may extend to physically impossible numbers.
    """
    tables = _moved(unit, free, x)
    names = dict.fromkeys(free.name.replace("spring_rise", "spring_closed") for free in FREE)
    fields = [(name, *name.split(".")) for name in names]
    return {name: np.atleast_1d(tables[section][field]) for name, section, field in fields}


def _with_rise(mechanics: dict[str, Any]) -> dict[str, Any]:
    return mechanics | {
        "spring_rise": tuple(np.subtract(mechanics["spring_closed"], mechanics["spring_open"]).tolist())
    }


def _without_rise(mechanics: dict[str, Any]) -> dict[str, Any]:
    kept = {field: value for field, value in mechanics.items() if field != "spring_rise"}
    return kept | {"spring_closed": tuple(np.add(mechanics["spring_open"], mechanics["spring_rise"]).tolist())}


def _misses(trace: Trace, unit: Unit, firmware: str, phase_s: float) -> Floats:
    """Return predicted minus recorded counts; for a shaft beyond the window, a current difference scaled to counts."""
    predicted = replay(trace, unit, firmware=firmware, side=trace.side, phase_s=phase_s, fields=READ[:2])
    missed = predicted.counts - trace.counts
    pull = (trace.currents - predicted.currents) / (1e-3 * unit.servos.current_floor_ma)
    closed: Floats = np.where(trace.beyond(), pull, missed)
    return closed
