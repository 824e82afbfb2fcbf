"""Response: delay from command to motion, age of readings, and opening and closing rate.

Records `codes` and `command_codes`; encoders are polled as fast as the link permits.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aero.channels import FINGERS, Channel
from aero.floats import Floats
from aero.protocol import MAX_CODE, Opcode
from hil.checks.shared.experiment import Measured, read, require
from hil.checks.shared.signals import CommandStep, find_steps, in_force
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording, Series
from hil.targets.target import Target
from hil.targets.wire_log import WireRecord

NUDGES = 6
NUDGE = 0.15
NUDGE_S = 0.36
SLOWEST_TELEMETRY_S = 0.02
"""Telemetry period of firmware `pre`, s; `NUDGE_S` is a multiple.

The nudges are spread over one period, so that their median is independent of the phase.
"""
POLL_S = 0.001
"""Shortest time between two readings, s."""
CYCLES = 3
CYCLE_LIMIT_S = 2.0
"""Time-out of a half cycle, s."""
OPENED, CLOSED = 0.06, 0.9
"""Fractions of the range at which the fingers count as open and closed."""
CHANNEL = Channel.RING
"""Finger of the nudges, chosen arbitrarily."""
FURTHEST = (1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
"""Largest commanded fraction of each channel's window, command order."""
MOVED_CODES = 60
"""Threshold of motion, codes: three counts of a finger."""
FAR, SETTING_OUT = 0.2, 0.05
"""Fractions of the range for the standstill check.

A finger further than `FAR` from its goal must be moving, unless it is within `SETTING_OUT` of an end, where it starts.
"""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Nudge one finger several times, then open and close all four at full speed."""
    recorder.begin({"nudge": NUDGE, "cycles": CYCLES})
    total = NUDGES + 2 * CYCLES
    for i in range(NUDGES):
        _command(target, recorder, NUDGE if i % 2 == 0 else 0.0, fingers=(CHANNEL,))
        until = target.clock.now() + NUDGE_S + SLOWEST_TELEMETRY_S / NUDGES
        while target.clock.now() < until:
            _read(target, recorder)
        progress((i + 1) / total, "command to motion")
    open_and_close(target, recorder, lambda part, doing: progress((NUDGES + 2 * CYCLES * part) / total, doing))


def open_first(target: Target, recorder: Recorder) -> None:
    """Open the hand, which is in another posture after other experiments, so that the first cycle is a whole one."""
    _command(target, recorder, 0.0, fingers=())
    until = target.clock.now() + CYCLE_LIMIT_S / 2
    while target.clock.now() < until:
        _read(target, recorder)


def open_and_close(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Close and open all fingers `CYCLES` times at full speed, each way until they have arrived."""
    recorder.note_parameters(cycles_from_s=target.clock.now() - recorder.start)
    for i in range(2 * CYCLES):
        _command(target, recorder, 1.0 if i % 2 == 0 else 0.0, fingers=range(4))
        until = target.clock.now() + CYCLE_LIMIT_S
        while not _arrived(_read(target, recorder), closing=i % 2 == 0):
            if target.clock.now() > until:
                recorder.note("the fingers did not arrive", "warning")
                break
        progress((i + 1) / (2 * CYCLES), "open and close")


def _command(target: Target, recorder: Recorder, fraction: float, fingers: range | tuple[Channel, ...]) -> None:
    codes = np.zeros(len(Channel), np.uint16)
    codes[list(fingers)] = round(fraction * MAX_CODE)
    commanded = target.clock.now()
    target.hand.command_codes(codes)
    sent = max(commanded, target.wire.sent_at)  # a driver may send later
    if not recorder.has("command_codes"):
        recorder.add("command_codes", sent, np.zeros(len(Channel), np.uint16))
    recorder.add("command_codes", sent, codes)


def _read(target: Target, recorder: Recorder) -> np.ndarray[tuple[int], np.dtype[np.uint16]]:
    target.clock.sleep_until(target.clock.now() + POLL_S)
    codes, _ = read(target, recorder, target.hand.read_codes)
    recorder.add("codes", target.clock.now(), codes)
    return codes


def _arrived(codes: NDArray[Any], *, closing: bool) -> bool:
    fingers = codes[:4] / MAX_CODE
    return bool(np.all(fingers >= CLOSED) if closing else np.all(fingers <= OPENED))


def measure(recording: Recording) -> Measured:
    """Return delays (ms) and the open-close rate (Hz) of the hand."""
    codes, commands = recording["codes"], recording["command_codes"]
    cycles = recording.header.number("cycles_from_s")
    commanded = find_steps(commands.times, commands.values)
    steps = [step for step in commanded if step.start < cycles]
    requests = asked_at(codes.times, recording.wire)
    delays = [motion_after(step, requests, codes.values[:, CHANNEL]) for step in steps]
    changed = codes.times[1:][np.any(np.diff(codes.values, axis=0) != 0, axis=1)]
    require(changed.size > 1, "the cycles")
    fast = _after(codes, cycles)
    goals = in_force(commands, fast.times)
    asked = requests[codes.times >= cycles]
    still = {f: standstills(asked, fast.times, fast.values[:, f], goals[:, f]) for f in FINGERS}
    return {
        **{finger.label: {"standstill": 1e3 * max(found, default=np.nan)} for finger, found in still.items()},
        "hand": {
            "command_to_motion": 1e3 * float(np.median(delays)),
            "telemetry_period": 1e3 * float(np.median(np.diff(changed))),
            "open_close_rate": open_close_rate(recording),
        },
    }


def open_close_rate(recording: Recording) -> float:
    """Return the rate of the cycles that `open_and_close` made, Hz; NaN if not all fingers arrived each time."""
    codes, commands = recording["codes"], recording["command_codes"]
    cycles = recording.header.number("cycles_from_s")
    fast = _after(codes, cycles)
    require(len(fast.times) > 1, "the cycles")
    steps = find_steps(commands.times, commands.values)
    swept = [step for step in steps if step.start >= cycles and step.channel == CHANNEL]
    return CYCLES / float(codes.times[-1] - cycles) if swept and all_arrived(swept, fast) else np.nan


def all_arrived(steps: Sequence[CommandStep], fast: Series) -> bool:
    """Return whether all fingers had arrived at the end of every half cycle.

    Args:
        steps: commands of the half cycles, one a half cycle.
        fast: `codes` of the cycles.
    """
    ends = [*(step.start for step in steps[1:]), float(fast.times[-1])]
    last = np.searchsorted(fast.times, ends, side="right") - 1
    return all(
        _arrived(fast.values[row], closing=step.after > step.before)
        for step, end, row in zip(steps, ends, last, strict=True)
        if end > step.start
    )


def motion_after(step: CommandStep, asked: Floats, codes: Floats) -> float:
    """Return the time from a command to the motion that it causes, s; NaN without motion.

    Motion began to show between the request that did not show it and the one that did; the middle stands for it, so
    that a host which asks late, or seldom, reads the same as one that does not.

    Args:
        step: the command.
        asked: (n,) float, when each reading was asked for, s.
        codes: (n,) float, readings of the channel.
    """
    after = np.flatnonzero(asked > step.start)
    # Only motion in the commanded direction counts; the finger may still creep from the step before.
    moved = after[np.sign(step.after - step.before) * (codes[after] - codes[after[:1]]) > MOVED_CODES]
    return float(asked[moved[0] - 1 : moved[0] + 1].mean()) - step.start if moved.size else np.nan


def asked_at(times: Floats, wire: tuple[WireRecord, ...]) -> Floats:
    """Return the request times (n,), s, of readings that arrived at `times` (n,): the last request before each.

    Other requests of the driver while a reading is late do not count.
    """
    asked = [record.t for record in wire if record.direction == "to_hand" and record.data[0] == Opcode.GET_POS]
    requests = np.array(asked or [np.nan])
    found: Floats = requests[np.searchsorted(requests, times, side="right") - 1]
    return found


def standstills(asked: Floats, times: Floats, codes: Floats, goals: Floats) -> list[float]:
    """Return the durations (s) of unchanged readings of a finger in motion.

    A reading was true at some time between its request and its arrival, so what counts is the time from the first one's
    arrival to the last one's request. A program that was late does not count, nor does an answer that was.

    Args:
        asked: (n,) float, when each reading was asked for, s.
        times: (n,) float, when it came, s.
        codes: (n,) float, readings of the finger.
        goals: (n,) float, its commands in force.
    """
    part = codes / MAX_CODE
    on_its_way = (np.abs(goals / MAX_CODE - part) > FAR) & (np.minimum(part, 1.0 - part) > SETTING_OUT)
    changes = np.flatnonzero(np.diff(part) != 0) + 1
    return [
        max(float(asked[last] - times[first]), 0.0)
        for first, last in zip(changes[:-1], changes[1:] - 1, strict=True)
        if on_its_way[first] and on_its_way[last]
    ]


def _after(series: Series, t: float) -> Series:
    late = series.times >= t
    return Series.of(series.columns, series.units, series.times[late], series.values[late])
