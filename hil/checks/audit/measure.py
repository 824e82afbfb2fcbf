"""How far each channel followed its own command, came back, and moved with the others."""

from __future__ import annotations

import numpy as np

from aero.actuation.fingerprint import fits_span
from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.audit.run import HALF_S, NUDGE
from hil.checks.shared.closing_current import closing_current
from hil.checks.shared.command_steps import find_steps
from hil.checks.shared.experiment import Measured, map_of
from hil.checks.shared.signals import at_times
from hil.recordings.recording import Recording


def measure(recording: Recording) -> Measured:
    """Return, in per cent of the nudge, how far each channel followed, came back, and moved with the others."""
    codes, commands, currents = (recording[name] for name in ("codes", "command_codes", "currents"))
    pull = at_times(currents.times, closing_current(currents.values, recording.header.hand), codes.times)
    spans = map_of(recording.header).window.spans_counts()
    found: dict[str, dict[str, float]] = {}
    closing = [step for step in find_steps(commands.times, commands.values) if step.after > step.before]
    for step in closing:
        start, nudged = _row(codes.times, step.start), _row(codes.times, step.end)
        moved = (codes.values[nudged] - codes.values[start]) / (NUDGE * MAX_CODE) * 100.0
        others = np.delete(moved, step.channel)
        back = codes.values[_row(codes.times, step.end + HALF_S), step.channel]
        found[Channel(step.channel).label] = {
            "followed": float(moved[step.channel]),
            "others_moved": float(np.abs(others).max()),
            "came_back": 100.0 - float(back - codes.values[start, step.channel]) / (NUDGE * MAX_CODE) * 100.0,
            "pull": float(pull[nudged, step.channel] - pull[start, step.channel]),
            "quantum_fits": 100.0 * float(fits_span(codes.values[:, step.channel], spans[step.channel]).mean()),
        }
    return found


def _row(times: np.ndarray[tuple[int], np.dtype[np.float64]], t: float) -> int:
    """Return the last sample taken before a command at `t`."""
    return int(np.searchsorted(times, t)) - 1
