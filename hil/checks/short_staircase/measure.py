"""Rise time, tracking and completed part of the steps of each channel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from hil.checks.shared.experiment import Measured
from hil.checks.shared.signals import display_unit, find_steps, rms
from hil.checks.short_staircase.run import STEPS
from hil.checks.staircase.rise_time import IN_TIME_S, respond
from hil.checks.staircase.tracking import residuals
from hil.recordings.recording import Recording

Floats = NDArray[np.float64]

LEAST_PART = 0.5
"""Part of a step that has to be made for its rise to count: friction swallows some of those that turn back."""


def measure(recording: Recording) -> Measured:
    """Return, by channel, rise (ms; % of the others'), settled residual in its sweep (mm, mrad), share of a step (%).

    The rise of a channel is withheld where the host was late in all of its steps.

    Raises:
        ValueError: it is too short to evaluate.
    """
    command, hand = recording["command"], recording["hand"]
    residual, settled = residuals(recording)
    steps = find_steps(command.times, command.values)
    found: dict[str, dict[str, float]] = {}
    rises, told = np.full(len(Channel), np.nan), list[Channel]()
    for channel in Channel:
        own = [step for step in steps if step.channel == channel]
        if len(own) != len(STEPS) + 1:
            raise ValueError(f"{channel.label} has {len(own)} of {len(STEPS) + 1} steps; was the recording cut short?")
        answers = [(step, respond(step, hand.times, hand.values[:, channel])) for step in own[1:-1]]
        parts = [answer.change / (step.after - step.before) for step, answer in answers]
        made = [answer for (_, answer), part in zip(answers, parts, strict=True) if part >= LEAST_PART]
        _, scale = display_unit(command.units[channel])
        mine = settled[:, channel] & (hand.times > own[0].start) & (hand.times < own[-1].start)
        in_time = [answer.rise for answer in made if answer.gap <= IN_TIME_S]
        rises[channel] = 1e3 * float(np.median(in_time)) if in_time else np.nan
        found[channel.label] = {
            "tracking_rms": rms(scale * residual[mine, channel]) if mine.any() else np.nan,
            "step_percent": 100.0 * float(np.median(parts)),
        }
        if in_time or not made:
            told.append(channel)
    for channel in told:
        found[channel.label]["rise_hand_ms"] = float(rises[channel])
        if len(told) == len(Channel) or np.isfinite(np.delete(rises, channel)).any():
            found[channel.label]["rise_percent"] = beside_the_others(rises, channel)
    return found


def beside_the_others(rises: Floats, channel: Channel) -> float:
    """Return the rise of a channel as a part of the median of the other six, %; NaN where it cannot be told.

    Supply and motors are those of one hand, so this varies much less between healthy hands than the rise itself.
    """
    others = np.delete(rises, channel)
    known = others[np.isfinite(others)]
    return 100.0 * float(rises[channel] / np.median(known)) if known.size else np.nan
