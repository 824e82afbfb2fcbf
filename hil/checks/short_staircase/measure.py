"""Rise time, tracking and completed part of the steps of each channel."""

from __future__ import annotations

import numpy as np

from aero.channels import Channel
from hil.checks.shared.command_steps import find_steps
from hil.checks.shared.experiment import Measured
from hil.checks.shared.signals import display_unit, rms
from hil.checks.short_staircase.run import STEPS
from hil.checks.staircase.rise_time import respond
from hil.checks.staircase.settled import residuals
from hil.recordings.recording import Recording

LEAST_PART = 0.5
"""Part of a step that has to be made for its rise to count: friction swallows some of those that turn back."""


def measure(recording: Recording) -> Measured:
    """Return, by channel, rise (ms), settled residual over its own sweep (mm, mrad), and share of a step (%).

    Raises:
        ValueError: it is too short to evaluate.
    """
    command, hand = recording["command"], recording["hand"]
    residual, settled = residuals(recording)
    steps = find_steps(command.times, command.values)
    found: dict[str, dict[str, float]] = {}
    for channel in Channel:
        own = [step for step in steps if step.channel == channel]
        if len(own) != len(STEPS) + 1:
            raise ValueError(f"{channel.label} has {len(own)} of {len(STEPS) + 1} steps; was the recording cut short?")
        answers = [(step, respond(step, hand.times, hand.values[:, channel])) for step in own[1:-1]]
        parts = [answer.change / (step.after - step.before) for step, answer in answers]
        rises = [answer.rise for (_, answer), part in zip(answers, parts, strict=True) if part >= LEAST_PART]
        _, scale = display_unit(command.units[channel])
        mine = settled[:, channel] & (hand.times > own[0].start) & (hand.times < own[-1].start)
        found[channel.label] = {
            "rise_hand_ms": 1e3 * float(np.median(rises)) if rises else np.nan,
            "tracking_rms": rms(scale * residual[mine, channel]) if mine.any() else np.nan,
            "step_percent": 100.0 * float(np.median(parts)),
        }
    return found
