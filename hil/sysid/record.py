"""Play an excitation on a hand and record what calibration needs, ready to stop."""

from __future__ import annotations

import numpy as np

from aero.protocol import MAX_CODE
from hil.recorder import Progress, Recorder, silent
from hil.recording import Recording
from hil.sysid.excitation import PERIOD_S, Excitation
from hil.sysid.guard import AbortLimits, Guard
from hil.target import Target

TEMPERATURE_EVERY = 25
"""Frames from one reading of the temperatures to the next."""
OPENING_S = 2.0
"""How long a hand takes to open at the end of a recording, however it ended, s."""
EXPERIMENT = "excitation"


def record(
    target: Target, excitation: Excitation, *, limits: AbortLimits | None = None, progress: Progress = silent
) -> Recording:
    """Play an excitation and return the recording; the hand opens slowly at the end, after an abort and on Ctrl-C.

    Each frame reads positions and currents first and commands after, as a policy does.

    Args:
        target: the hand; it moves through the reach of the excitation.
        excitation: what to play.
        limits: when to stop; the defaults when left out.
        progress: called once a frame.

    Returns:
        A recording with `codes`, `command_codes` (u16), `currents` (A) and `temperatures` (degC). One that was broken
        off has an event of severity `error` that says why.
    """
    hand, clock = target.hand, target.clock
    recorder, guard = Recorder(target), Guard(limits or AbortLimits())
    codes = np.rint(excitation.fractions * MAX_CODE).astype(np.int64)
    command = codes[0]
    celsius = hand.read_temperatures()
    try:
        for frame, wanted in enumerate(codes):
            clock.sleep_until(recorder.start + frame * PERIOD_S)
            now = clock.now()
            position = hand.read_codes()
            currents = hand.read_currents()
            recorder.add("codes", now, position)
            recorder.add("currents", now, currents)
            if frame % TEMPERATURE_EVERY == 0:
                celsius = hand.read_temperatures()
                recorder.add("temperatures", now, celsius)
            objection = guard.objection(now, command / MAX_CODE, position / MAX_CODE, currents, celsius)
            if objection is not None:
                recorder.note(f"stopped: {objection}", "error")
                break
            hand.command_codes(wanted)
            recorder.add("command_codes", clock.now(), wanted)
            command = wanted
            progress((frame + 1) / len(codes), excitation.name)
    finally:
        _open(target, command)
    return recorder.finish(EXPERIMENT, {"excitation": excitation.name, "period_s": PERIOD_S})


def _open(target: Target, command: np.ndarray) -> None:
    """Ramp from a command to the open hand."""
    start = target.clock.now()
    frames = round(OPENING_S / PERIOD_S)
    for frame in range(frames):
        target.clock.sleep_until(start + frame * PERIOD_S)
        target.hand.command_codes(np.rint(command * (1.0 - (frame + 1) / frames)).astype(np.int64))
