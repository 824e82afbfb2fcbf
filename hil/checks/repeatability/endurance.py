"""Endurance: fifty closures of the whole hand to a fist. Runs only by name."""

from aero.channels import Channel
from hil.checks.repeatability.check import close_again, measure
from hil.recordings.recorder import Progress, Recorder
from hil.targets.target import Target

__all__ = ["FURTHEST", "measure", "run"]

CYCLES, HALF_S = 50, 0.9
FURTHEST = (1.0,) * len(Channel)
"""Largest commanded fraction of each channel's window, command order."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Close and open the whole hand repeatedly."""
    close_again(target, recorder, progress, posture=FURTHEST, closures=CYCLES, hold_s=HALF_S)
