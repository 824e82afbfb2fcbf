"""Presence: does a hand answer, completely and freshly, while nothing moves?

Leaves `codes`, `currents` and `temperatures`, and the bytes on the wire. The hand is not commanded.
"""

from __future__ import annotations

from hil.recordings.recorder import Progress, Recorder
from hil.targets.boot_text import identify
from hil.targets.target import Target

READINGS = 30
PERIOD_S = 0.025
FURTHEST = (0.0,) * 7
"""How far each channel is sent at most, part of its window, command order."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Read everything a few dozen times."""
    recorder.begin({"readings": READINGS, "period_s": PERIOD_S})
    for i in range(READINGS):
        target.clock.sleep_until(recorder.start + i * PERIOD_S)
        recorder.add("codes", target.clock.now(), target.hand.read_codes())
        recorder.add("currents", target.clock.now(), target.hand.read_currents())
        recorder.add("temperatures", target.clock.now(), target.hand.read_temperatures())
        progress((i + 1) / READINGS, "reading")
    text = target.hand.boot_text
    if text:
        recorder.note(f"the board has restarted: {identify(text).describe()}", "warning")
    recorder.note_parameters(boot_text=text)
