"""Response: how long from a command to motion, how old readings are, and how fast the hand opens and closes.

Leaves `codes` and `command_codes`; encoders are read as fast as the link allows.
"""

from __future__ import annotations

import numpy as np

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.experiments.presence import round_trips
from hil.experiments.shared import subjects
from hil.experiments.shared.command_steps import find_steps
from hil.experiments.shared.experiment import Experiment, Measured, Metric
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.target import Target

NUDGES = 6
NUDGE = 0.15
NUDGE_S = 0.36
SLOWEST_TELEMETRY_S = 0.02
"""Period of firmware `pre`, of which `NUDGE_S` is a multiple; the nudges are spread over it, so that their median does
not depend on when they began."""
POLL_S = 0.001
"""Least time between two readings, s."""
CYCLES = 3
CYCLE_LIMIT_S = 2.0
"""Time one half cycle may take before it counts as never arriving, s."""
OPENED, CLOSED = 0.06, 0.9
"""Parts of the range at which the fingers count as open and closed."""
MOVED_CODES = 60
"""Change that counts as motion: three counts of a finger."""
CHANNEL = Channel.RING
"""The finger that is watched: any would do."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Nudge one finger a few times, then open and close all four as fast as they go."""
    recorder.begin({"nudge": NUDGE, "cycles": CYCLES})
    total = NUDGES + 2 * CYCLES
    for i in range(NUDGES):
        _command(target, recorder, NUDGE if i % 2 == 0 else 0.0, fingers=(CHANNEL,))
        until = target.clock.now() + NUDGE_S + SLOWEST_TELEMETRY_S / NUDGES
        while target.clock.now() < until:
            _read(target, recorder)
        progress((i + 1) / total, "command to motion")
    recorder.note_parameters(cycles_from_s=target.clock.now() - recorder.start)
    for i in range(2 * CYCLES):
        _command(target, recorder, 1.0 if i % 2 == 0 else 0.0, fingers=range(4))
        until = target.clock.now() + CYCLE_LIMIT_S
        while not _arrived(_read(target, recorder), closing=i % 2 == 0):
            if target.clock.now() > until:
                recorder.note("the fingers did not arrive", "warning")
                break
        progress((NUDGES + i + 1) / total, "open and close")


def measure(recording: Recording) -> Measured:
    """Return delays (ms) and the open-close rate (Hz) of the hand."""
    codes, commands = recording["codes"], recording["command_codes"]
    cycles = float(recording.header.parameters["cycles_from_s"])
    steps = [step for step in find_steps(commands.times, commands.values) if step.start < cycles]
    trace = codes.values[:, CHANNEL]
    delays = []
    for step in steps:
        after = np.flatnonzero(codes.times > step.start)
        # Only motion the way it was told counts: the finger may still creep out of the step before.
        moved = after[np.sign(step.after - step.before) * (trace[after] - trace[after[0]]) > MOVED_CODES]
        delays.append(codes.times[moved[0]] - step.start if moved.size else np.nan)
    changed = codes.times[1:][np.any(np.diff(codes.values, axis=0) != 0, axis=1)]
    _, trips = round_trips(recording.wire)
    arrived = not any(event.severity == "warning" for event in recording.events)
    rate = CYCLES / (codes.times[-1] - cycles) if arrived else np.nan
    return {
        "hand": {
            "round_trip": 1e3 * float(np.median(trips)),
            "command_to_motion": 1e3 * float(np.median(delays)),
            "telemetry_period": 1e3 * float(np.median(np.diff(changed))),
            "open_close_rate": float(rate),
        }
    }


def _command(target: Target, recorder: Recorder, fraction: float, fingers: range | tuple[Channel, ...]) -> None:
    codes = np.zeros(len(Channel), np.uint16)
    codes[list(fingers)] = round(fraction * MAX_CODE)
    if not recorder.has("command_codes"):
        recorder.add("command_codes", target.clock.now(), np.zeros(len(Channel), np.uint16))
    recorder.add("command_codes", target.clock.now(), codes)
    target.hand.command_codes(codes)


def _read(target: Target, recorder: Recorder) -> np.ndarray[tuple[int], np.dtype[np.uint16]]:
    target.clock.sleep_until(target.clock.now() + POLL_S)
    codes = target.hand.read_codes()
    recorder.add("codes", target.clock.now(), codes)
    return codes


def _arrived(codes: np.ndarray[tuple[int], np.dtype[np.uint16]], *, closing: bool) -> bool:
    fingers = codes[:4] / MAX_CODE
    return bool(np.all(fingers >= CLOSED) if closing else np.all(fingers <= OPENED))


METRICS = (
    Metric(
        "command_to_motion",
        "ms",
        subjects.HAND,
        (
            "The hand starts late, or, below the range, moves before it can: then its encoder is noisy or "
            "something else moves it."
        ),
        "Look for what else runs on the machine and for a hub or a network between it and the hand.",
    ),
    Metric(
        "telemetry_period",
        "ms",
        subjects.HAND,
        ("Readings are refreshed at another rate than the firmware's: another version, or a bus that loses cycles."),
        "Check the firmware on the board, then the servo bus for a servo that answers only sometimes.",
    ),
    Metric(
        "open_close_rate",
        "Hz",
        subjects.HAND,
        "The hand opens and closes slowly, or does not get there.",
        "Slow closing: supply or a speed limit. Slow opening: return springs and friction.",
    ),
    Metric("round_trip", "ms", subjects.HAND, "Median time from a request to its complete reply."),
)
"""What is measured, and what it means when it is off."""

EXPERIMENT = Experiment(
    "response",
    "Delays, and how fast the hand opens and closes",
    run,
    measure,
    (1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0),
    METRICS,
    rank=40,
)
