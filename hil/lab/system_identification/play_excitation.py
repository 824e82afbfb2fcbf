"""Play an excitation on a hand and record what calibration needs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aero.protocol import MAX_CODE
from aero.safety import SafetyStopError
from hil.lab.system_identification.excitation import PERIOD_S, Excitation
from hil.recordings.recorder import Progress, Recorder, silent
from hil.targets.target import Target

TEMPERATURE_EVERY = 25
"""Frames from one reading of the temperatures to the next."""
OPENING_S = 2.0
"""Time of the way back to the open hand after an interruption, s."""
EXPERIMENT = "excitation"


def play(target: Target, recorder: Recorder, excitation: Excitation, *, progress: Progress = silent) -> None:
    """Play an excitation into a recorder; the hand ends open, on Ctrl-C too.

    Each frame reads positions and currents first and commands after, as a policy does.

    Args:
        target: the hand; it moves through the reach of the excitation.
        recorder: begun here. It is left with `codes`, `command_codes` (u16), `currents` (A) and `temperatures` (degC);
            after a stop by the guard, with an event of severity `error` that says why.
        excitation: what to play.
        progress: called once a frame.

    Raises:
        SafetyStopError: a guarded hand was stopped, or must not be moved at all.
    """
    hand, clock = target.hand, target.clock
    target.begin()
    recorder.begin({"excitation": excitation.name, "period_s": PERIOD_S})
    codes = np.rint(excitation.fractions * MAX_CODE).astype(np.int64)
    command = codes[0]
    try:
        for frame, wanted in enumerate(codes):
            clock.sleep_until(recorder.start + frame * PERIOD_S)
            now = clock.now()
            recorder.add("codes", now, hand.read_codes())
            recorder.add("currents", now, hand.read_currents())
            if frame % TEMPERATURE_EVERY == 0:
                recorder.add("temperatures", now, hand.read_temperatures())
            sent = clock.now()
            hand.command_codes(wanted)
            recorder.add("command_codes", sent, wanted)
            command = wanted
            progress((frame + 1) / len(codes), excitation.name)
    except SafetyStopError as stop:
        recorder.note(str(stop), "error")
        command = np.zeros_like(command)  # the guard opens the hand itself
        raise
    finally:
        _open(target, command)


def _open(target: Target, command: NDArray[np.int64]) -> None:
    """Ramp from a command to the open hand; nothing to do when it asked for that already."""
    if not command.any():
        return
    start = target.clock.now()
    frames = round(OPENING_S / PERIOD_S)
    for frame in range(frames):
        target.clock.sleep_until(start + frame * PERIOD_S)
        target.hand.command_codes(np.rint(command * (1.0 - (frame + 1) / frames)).astype(np.int64))
