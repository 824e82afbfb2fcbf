"""Measurement of a hand's cables before a policy runs: slack of long cables, closed stops of short ones.

Each cable is wound slowly until taut, then each digit is driven into its closed stop. A long cable turns its spool
freely until the springs load it: the servo's position error steps up at a travel that is the slack. A short cable is
taut from the start, and its digit meets its stop early. The hand must be free, because the motion closes it.

The joints of the thumb close one after the other, its tip with the thumb opposed: both together press the tip into the
palm, which stops CMC flexion up to 3 mm before its own stop.

The corrections follow from these travels by lines fitted to healthy hands (`train/cable_measurement.py`).
"""

import tomllib
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np

from aero.actuation.map import ActuationMap
from aero.channels import CABLES, FINGERS, Channel
from aero.clock import Clock
from aero.floats import Floats
from aero.hand import Hand
from aero.policy.running import correction_spread, typical_correction
from aero.protocol import MAX_CODE

MEASURED = "measured"
"""Name of the correction that is measured at the start of a run."""
LINES_FILE = "cable_measurement.toml"
MEASURING_S = 4.95
"""Duration of the motion, s."""
PERIOD_S = 0.02
SLOW_M = 6.2e-3
"""Travel of the slow winding, m: the slack of a cable 3 mm longer than any healthy one."""
REACH = dict.fromkeys(CABLES, 1.0) | {Channel.THUMB_FLEXOR: 0.95}
"""Commands that drive digits into their closed stops, fraction of the window."""
TORQUE_SHARE = 0.5
"""Limit of the torque at the stops, fraction of the stall torque; at 0.3 stiff springs hold a finger off its stop."""
SPAN_M = 3.5e-4
"""Travel over which the position error is averaged before and after a step, m."""
STEP_M = 4.5e-5
"""Threshold of a step of the position error, m; the springs of a weak finger cause 0.09 mm, a winding cable 0.02 mm."""
FREE_M = 2e-4
"""Threshold of the slack, m; the static friction of a spool causes steps before it."""
STOPPED_M = 9e-4
"""Threshold of the position error at a stop, m; the stiffest digit before its stop has 0.8 mm."""
SURE_M = 5e-4
"""Threshold of the half interval, m; above it a correction is unsure."""


class Seen(Enum):
    """Observation from which a correction follows."""

    SLACK = "slack"
    STOP = "stop"
    NEITHER = "neither"
    """Just taut from the start, and its stop is beyond the window."""
    NOTHING = "nothing"
    """Not observed: the hand was not driven into its stops."""


class Travels(NamedTuple):
    """Travels of one cable above the lower end of its window, m."""

    slack: float
    """NaN for a cable that was taut from the start."""
    stop: float
    """NaN for a digit that was not driven into its stop, infinite for one whose stop is beyond its window."""


class Line(NamedTuple):
    """Correction as a linear function of observed travels, of one kind of observation."""

    offset: float
    own: float
    """Slope by the cable's own travel, m/m."""
    thumb: float
    """Slope by the stop of CMC flexion, m/m; the flexor passes the CMC joint."""
    deviation: float
    """Standard deviation of the residuals on healthy hands, m."""


@dataclass(frozen=True)
class MeasuredCable:
    """Correction of one cable."""

    correction: float
    """Correction, m; the typical one if nothing was observed."""
    within: float
    """Half width of the 95 % interval, m."""
    seen: Seen

    @property
    def sure(self) -> bool:
        """Whether the interval is narrow enough."""
        return self.within <= SURE_M


@dataclass(frozen=True)
class Samples:
    """Record of the motion; arrays are (samples, ...)."""

    times: Floats
    """Times from the start, s."""
    wanted: Floats
    """Commanded travel above the lower end of the window, (samples, 7), m, abduction rad."""
    travel: Floats
    """Read travel, likewise."""
    currents_a: Floats
    """Motor currents, (samples, 7), A."""


@dataclass(frozen=True)
class Measurement:
    """Result for all cables."""

    cables: Mapping[Channel, MeasuredCable]
    samples: Samples

    @property
    def correction(self) -> tuple[float, ...]:
        """Correction of all channels, (7,), m; abduction has no cable."""
        return tuple(self.cables[one].correction if one in self.cables else 0.0 for one in Channel)


def measure(
    hand: Hand,
    clock: Clock,
    actuation_map: ActuationMap,
    *,
    to_stops: bool,
    moved: Callable[[float], None] = lambda _: None,
) -> Measurement:
    """Measure the cables of a free hand and return it to the lower end of its windows.

    Args:
        hand: open hand, guarded and with torques limited to `TORQUE_SHARE`.
        clock: clock of the hand.
        actuation_map: map for the hand's firmware.
        to_stops: False for a firmware without torque limits; only long cables are then observed.
        moved: called after each sample with the progress, 0 to 1.

    Raises:
        AeroError, ConnectionError: a failed reading or command.
        SafetyStopError: the guard stopped the hand.
    """
    samples = record(hand, clock, actuation_map, to_stops=to_stops, moved=moved)
    return Measurement(estimated(observed(samples)), samples)


def corners(stroke: Floats, *, to_stops: bool) -> tuple[Floats, Floats]:
    """Return times (k,), s, and travels (k, 7), m, of the corners of the motion, for windows of `stroke` (7,), m."""
    channels = list(Channel)

    def closed(digits: Collection[Channel]) -> Floats:
        return stroke * [REACH[channel] if channel in digits else 0.0 for channel in channels]

    slow, still = np.where(np.isin(channels, CABLES), SLOW_M, 0.0), np.zeros(len(channels))
    moves = [(0.0, still), (1.4, slow)]
    if to_stops:
        opposed = stroke * np.isin(channels, [Channel.THUMB_ABDUCTION])
        fingers, tip = closed(FINGERS), opposed + closed([Channel.THUMB_FLEXOR])
        base = closed([Channel.THUMB_CMC_FLEXION])
        # The thumb waits for the open fingers, which it could meet.
        moves += [(0.8, fingers), (0.2, fingers), (0.6, still), (0.5, base), (0.2, base), (0.6, tip), (0.2, tip)]
    spans, rows = zip(*moves, (0.45, still), strict=True)
    return np.cumsum(spans), np.array(rows)


def record(
    hand: Hand, clock: Clock, actuation_map: ActuationMap, *, to_stops: bool, moved: Callable[[float], None]
) -> Samples:
    """Perform the motion and return what was read; see `measure`."""
    stroke = actuation_map.travel_from_angles(np.ptp(actuation_map.window_rad, axis=1))
    times, travels = corners(stroke, to_stops=to_stops)
    begin, count, rows = clock.now(), round(float(times[-1]) / PERIOD_S), []
    for k in range(1, count + 1):
        wanted = np.array([np.interp(k * PERIOD_S, times, travel) for travel in travels.T])
        hand.command_codes(np.rint(wanted / stroke * MAX_CODE).astype(np.uint16))
        clock.sleep_until(begin + k * PERIOD_S)
        rows.append((clock.now() - begin, wanted, hand.read_codes() / MAX_CODE * stroke, hand.read_currents()))
        moved(k / count)
    return Samples(*(np.array(column) for column in zip(*rows, strict=True)))


def observed(samples: Samples) -> dict[Channel, Travels]:
    """Return the observed travels of each cable."""
    columns = {one: (samples.wanted[:, one], samples.travel[:, one]) for one in CABLES}
    return {one: Travels(_slack(*column), _stop(*column)) for one, column in columns.items()}


def _slack(wanted: Floats, travel: Floats) -> float:
    """Return the travel at the largest step of the position error in the slow winding; NaN without a step."""
    slow = slice(0, int(np.argmax(wanted >= SLOW_M - 1e-9)) + 1)
    wanted, travel = wanted[slow], travel[slow]
    error = wanted - travel
    largest, found = STEP_M, np.nan
    for at in wanted:
        before = error[(wanted >= max(at - SPAN_M, FREE_M)) & (wanted < at)]
        after = error[(wanted > at + SPAN_M) & (wanted <= at + 2 * SPAN_M)]
        if min(len(before), len(after)) < 2:
            continue
        step = float(after.mean() - before.mean())
        if step > largest:
            beyond = (wanted >= at) & (error >= before.mean() + step / 2)
            largest, found = step, float(travel[np.argmax(beyond)])
    return found if found >= FREE_M else np.nan


def _stop(wanted: Floats, travel: Floats) -> float:
    """Return the travel at the end of the longest command; infinite for a digit that followed it, NaN without one."""
    last = int(np.flatnonzero(wanted >= wanted.max() - 1e-9)[-1])
    if wanted[last] <= SLOW_M + 1e-9:
        return np.nan
    return float(travel[last]) if wanted[last] - travel[last] >= STOPPED_M else np.inf


@cache
def lines() -> Mapping[tuple[Channel, Seen], Line]:
    """Return the line of each cable and kind of observation."""
    table = tomllib.loads((files("aero.policy.shipped") / LINES_FILE).read_text(encoding="utf-8"))
    rows = {(one, kind): table[one.label].get(kind.value) for one in CABLES for kind in Seen}
    return {key: Line(**row) for key, row in rows.items() if row is not None}


def estimated(seen: Mapping[Channel, Travels]) -> dict[Channel, MeasuredCable]:
    """Return the correction of each cable: from its slack, else from its stop, else the typical one."""
    thumb, found = seen[Channel.THUMB_CMC_FLEXION].stop, {}
    for one in CABLES:
        found[one] = MeasuredCable(typical_correction()[one], 2.0 * correction_spread()[one], Seen.NOTHING)
        slack, stop = seen[one]
        beyond = 0.0 if np.isinf(stop) else np.nan
        for kind, own in ((Seen.NEITHER, beyond), (Seen.STOP, stop), (Seen.SLACK, slack)):
            if (line := lines().get((one, kind))) is None:
                continue
            value = line.offset + line.own * own + (line.thumb * thumb if line.thumb else 0.0)
            if np.isfinite(value):
                found[one] = MeasuredCable(value, 2.0 * line.deviation, kind)
    return found
