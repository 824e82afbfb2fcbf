"""A unit as a model: its numbers that calibration may change, and replays through the whole chain as prediction."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence, Set
from concurrent.futures import Executor
from dataclasses import dataclass
from itertools import cycle, islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aero.channels import CABLES, FINGERS, THUMB, Channel, Joint
from aero.firmware import DEFAULT_FIRMWARE
from aero.protocol import MAX_CODE
from model.units import Unit
from train.identification.trace import Trace
from train.identification.trace_replay import READ, replay

Floats = NDArray[np.float64]
Residuals = list[Floats]
"""Per trace (m, 7), predicted less recorded, counts."""

STEP = 0.3
"""Step of the finite differences in units of `Free.spread`: large, for counts are whole and friction has corners."""


@dataclass(frozen=True)
class Free:
    """One number that is searched for; zero is the start."""

    name: str
    """What it is."""
    indices: tuple[int, ...]
    """Which entries of a field of that name it moves; empty when the field is one number."""
    channels: tuple[Channel, ...]
    """Channels that feel it."""
    spread: float
    """Standard deviation that is believed before any data is seen."""
    additive: bool = False
    """Whether a field of a unit gains this number; else it is multiplied by its exponential."""
    step: float = STEP
    """Step of the finite differences in units of the spread."""


ALL = tuple(Channel)
SPRUNG: tuple[tuple[Channel, tuple[int, ...]], ...] = (
    *((finger, (3 * finger,)) for finger in FINGERS),
    *((finger, (3 * finger + 1, 3 * finger + 2)) for finger in FINGERS),
    (Channel.THUMB_CMC_FLEXION, (Joint.THUMB_CMC,)),
    (Channel.THUMB_FLEXOR, (Joint.THUMB_MCP, Joint.THUMB_IP)),
)
"""Joints whose springs load a cable; the knuckle closes first, so its springs show in another part of the stroke."""
JOINTS: tuple[tuple[Channel, tuple[int, ...]], ...] = (
    *((finger, (3 * finger, 3 * finger + 1, 3 * finger + 2)) for finger in FINGERS),
    (Channel.THUMB_ABDUCTION, (Joint.THUMB_ABDUCTION,)),
    *SPRUNG[-2:],
)
"""Joints that move with a channel."""
PHASES_S = (0.0, 0.0025, 0.005, 0.0075)
"""Where a recording may lie on the board's 10 ms telemetry grid, s."""


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
    # A short step: the pull on a taut cable changes within 0.1 mm.
    *(Free(TAKE_UP, (channel,), (channel,), 1e-3, additive=True, step=0.1) for channel in CABLES),
    Free("hand.supply_sag", (), ALL, 0.7),
    Free(CLOSED_STOP, tuple(range(12)), FINGERS, 0.01),
    Free("hand.abduction_winding", (0,), THUMB, 0.3),
    Free("hand.abduction_winding", (1,), THUMB, 0.3),
)
"""Numbers of a unit by `section.field`: logarithms of factors, or SI units that are added. `hand.spring_rise` is what
the springs gain from the open to the closed hand."""


KEPT: tuple[Free, ...] = (
    Free("servos.stall_torque", (), ALL, 0.1),
    Free("hand.supply_ratio", (), ALL, 0.1),
    Free("hand.cable_compliance", (), ALL, 0.4),
    *_each("hand.winding_scale", 0.02, tuple(CABLES)),
    *(Free("hand.joint_friction", joints, (channel,), 0.7) for channel, joints in JOINTS),
    *(Free("hand.joint_damping", joints, (channel,), 0.7) for channel, joints in JOINTS),
)
"""Numbers that encoders tell only against those above, with how far each may be off; they widen the intervals."""
MOVED = 0.01
"""Share of the command window that a channel is sent over at least where a recording excites it."""
STOPPED = 0.9
"""Share of it from which on a finger may meet its end stop; the recorded ones stop at 0.976."""


def excited(traces: Sequence[Trace]) -> frozenset[Channel]:
    """Return the channels that recordings move."""
    swept = np.max([np.ptp(trace.codes, axis=0) for trace in traces], axis=0)
    return frozenset(channel for channel in Channel if swept[channel] > MOVED * MAX_CODE)


def felt_otherwise(traces: Sequence[Trace]) -> dict[str, frozenset[Channel]]:
    """Return the channels of numbers that recordings tell otherwise than by moving a channel, by name.

    Currents tell the tension of an open hand, moving or not; only a finger that closes far meets its stop.
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
    """Return what recordings tell that move some channels, and what `otherwise` says by name.

    A number of which each entry belongs to one channel is told for those channels. What channels share is told when all
    of them move, so that fitting one channel changes no other.
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
    """A unit whose free numbers are looked for in traces of a right hand."""

    start: Unit
    """Where the search starts."""
    traces: tuple[Trace, ...]
    firmware: str = DEFAULT_FIRMWARE
    """What the recorded hand ran."""
    pool: Executor | None = None
    """Where replays run; in this process when None."""
    free: tuple[Free, ...] = FREE
    phases_s: tuple[float, ...] = PHASES_S
    replayed: Callable[[Trace], None] = lambda _trace: None
    """Called after each replay with its trace."""

    def unit(self, x: Floats) -> Unit:
        """Return the unit that free numbers (p,) stand for."""
        return apply(self.start, self.free, x)

    def numbers(self, x: Floats) -> dict[str, Floats]:
        """Return the numbers that free numbers (p,) stand for, by `section.field`."""
        return numbers_at(self.start, self.free, x)

    def residuals(self, x: Sequence[Floats], phases_s: Sequence[float]) -> Residuals:
        """Return predicted less recorded counts of each trace, for free numbers (p,) and a phase a trace.

        Several rounds of all traces may be asked for at once, one after the other, so that every process is busy.
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
    """Return a unit whose numbers are those of `unit` moved by `x`, (len(free),) float, as `FREE` says.

    Raises:
        ValueError: no hand can have such numbers.
    """
    tables = _moved(unit, free, x)
    servos = dataclasses.replace(unit.servos, **tables["servos"])
    hand = dataclasses.replace(unit.hand, **tables["hand"])
    return dataclasses.replace(unit, servos=servos, hand=hand)


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
    """Return the fields of a unit that calibration may change, arrays by `section.field`."""
    return numbers_at(unit, (), np.zeros(0))


def numbers_at(unit: Unit, free: Sequence[Free], x: Floats) -> dict[str, Floats]:
    """Return the same of `unit` moved by `x`, (len(free),), also where no hand can have such numbers.

    An interval may reach beyond what a hand can have.
    """
    tables = _moved(unit, free, x)
    names = dict.fromkeys(free.name.replace("spring_rise", "spring_closed") for free in FREE)
    fields = [(name, *name.split(".")) for name in names]
    return {name: np.atleast_1d(tables[section][field]) for name, section, field in fields}


def _with_rise(hand: dict[str, Any]) -> dict[str, Any]:
    return hand | {"spring_rise": tuple(np.subtract(hand["spring_closed"], hand["spring_open"]).tolist())}


def _without_rise(hand: dict[str, Any]) -> dict[str, Any]:
    kept = {field: value for field, value in hand.items() if field != "spring_rise"}
    return kept | {"spring_closed": tuple(np.add(hand["spring_open"], hand["spring_rise"]).tolist())}


def _misses(trace: Trace, unit: Unit, firmware: str, phase_s: float) -> Floats:
    """Return predicted less recorded counts, by the current where the encoder lies beyond the window."""
    predicted = replay(trace, unit, firmware=firmware, side=trace.side, phase_s=phase_s, fields=READ[:2])
    missed = predicted.counts - trace.counts
    pull = (trace.currents - predicted.currents) / (1e-3 * unit.servos.current_floor_ma)
    closed: Floats = np.where(trace.beyond(), pull, missed)
    return closed
