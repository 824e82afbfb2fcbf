"""Response: how long from a command to motion, how old readings are, and how fast the hand opens and closes.

Leaves `codes` and `command_codes`; encoders are read as fast as the link allows.
"""

from __future__ import annotations

import numpy as np

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.recordings.recorder import Progress, Recorder
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
CHANNEL = Channel.RING
"""The finger that is watched: any would do."""
FURTHEST = (1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
"""How far each channel is sent at most, part of its window, command order."""
NOT_ARRIVED = "the fingers did not arrive"
"""Event of a cycle that took too long."""


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
                recorder.note(NOT_ARRIVED, "warning")
                break
        progress((NUDGES + i + 1) / total, "open and close")


def _command(target: Target, recorder: Recorder, fraction: float, fingers: range | tuple[Channel, ...]) -> None:
    codes = np.zeros(len(Channel), np.uint16)
    codes[list(fingers)] = round(fraction * MAX_CODE)
    target.hand.command_codes(codes)
    sent = target.wire.sent_at
    if not recorder.has("command_codes"):
        recorder.add("command_codes", sent, np.zeros(len(Channel), np.uint16))
    recorder.add("command_codes", sent, codes)


def _read(target: Target, recorder: Recorder) -> np.ndarray[tuple[int], np.dtype[np.uint16]]:
    target.clock.sleep_until(target.clock.now() + POLL_S)
    codes = target.hand.read_codes()
    recorder.add("codes", target.clock.now(), codes)
    return codes


def _arrived(codes: np.ndarray[tuple[int], np.dtype[np.uint16]], *, closing: bool) -> bool:
    fingers = codes[:4] / MAX_CODE
    return bool(np.all(fingers >= CLOSED) if closing else np.all(fingers <= OPENED))
