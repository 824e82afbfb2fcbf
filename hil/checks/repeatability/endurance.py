"""Endurance: the whole hand closes to a fist and opens fifty times. Asked for by name only."""

from __future__ import annotations

from aero.channels import Channel
from hil.checks.repeatability.check import close_again, measure
from hil.recordings.recorder import Progress, Recorder
from hil.targets.target import Target

__all__ = ["FURTHEST", "measure", "run"]

CYCLES, HALF_S = 50, 0.9
FURTHEST = (1.0,) * len(Channel)
"""How far each channel is sent at most, part of its window, command order."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Close the whole hand and open it, again and again."""
    close_again(target, recorder, progress, posture=FURTHEST, closures=CYCLES, hold_s=HALF_S)
