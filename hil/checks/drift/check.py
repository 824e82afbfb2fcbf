"""Drift: pace of the fingers at the end of a run, for comparison with its start (`alike`).

Repeats the cycles of `response`. Records `codes` and `command_codes`.
"""

from hil.checks.response.check import open_and_close, open_close_rate, open_first
from hil.checks.shared.experiment import Measured
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.target import Target

FURTHEST = (1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
"""Largest commanded fraction of each channel's window, command order."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Open the hand, then close and open all four fingers at full speed."""
    recorder.begin({})
    open_first(target, recorder)
    open_and_close(target, recorder, progress)


def measure(recording: Recording) -> Measured:
    """Return the rate of opening and closing, Hz."""
    return {"hand": {"open_close_rate": open_close_rate(recording)}}
