"""A short staircase: what tracking and rise time of every channel cost least, half a minute of hand time.

Each channel goes to a loose grasp, climbs two steps of 5 % of its range there, as the paper's staircase does, comes
down again and opens. Nothing meets a stop, so any firmware may run it, guarded or not. Five per cent tell most: a
servo's gain, its speed and its motion profile all show in such a step, and the hand's mechanics hardly do. Leaves what
`follow` leaves.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from hil.checks.shared.experiment import LOOSE_GRASP, Measured
from hil.checks.shared.side_by_side import follow
from hil.checks.shared.signals import display_unit, find_steps, rms
from hil.checks.staircase.reachable_range import calibrated_range, reachable
from hil.checks.staircase.rise_time import IN_TIME_S, respond
from hil.checks.staircase.tracking import residuals
from hil.recordings.errors import CannotBeMeasuredError
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.target import Target
from model import RoutedHand

Floats = NDArray[np.float64]

STEP = 0.05
"""Part of the range, as each of the paper's twenty levels."""
STEPS = (0, 1, 2, 1, 0)
"""Levels above the grasp, one after another, before the channel opens again."""
HOLD_S, LEAD_S = 0.6, 0.6
"""Time at each level, and at the open hand before the first, s; 0.4 s after a change a sample counts as settled."""
SAMPLE_PERIOD_S = 0.02
FURTHEST = tuple(foot + STEP * max(STEPS) for foot in LOOSE_GRASP)
"""How far each channel is sent at most, part of its window, command order."""
LEAST_PART = 0.5
"""Part of a step that has to be made for its rise to count: friction swallows some of those that turn back."""


def commands(open_lengths: Floats, closed_lengths: Floats) -> Floats:
    """Return the stream (n, 7) between where every channel waits and its closed end, both (7,); lengths, m and rad."""
    held = round(HOLD_S / SAMPLE_PERIOD_S)
    rows = [np.zeros((round(LEAD_S / SAMPLE_PERIOD_S), len(Channel)))]
    for channel, foot in zip(Channel, LOOSE_GRASP, strict=True):
        levels = [*(foot + STEP * step for step in STEPS), 0.0]
        rows.append(np.outer(np.repeat(levels, held), np.eye(len(Channel))[channel]))
    return open_lengths + np.vstack(rows) * (closed_lengths - open_lengths)


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Drive the target and the routed hand of its side through the steps."""
    simulator = RoutedHand(target.side)
    stream = commands(*reachable(target.map, calibrated_range(simulator)))
    follow(
        target,
        recorder,
        simulator,
        stream,
        period_s=SAMPLE_PERIOD_S,
        parameters={"step": STEP, "hold_s": HOLD_S, "lead_s": LEAD_S, "sample_period_s": SAMPLE_PERIOD_S},
        doing=lambda _: "short staircase",
        progress=progress,
    )


def measure(recording: Recording) -> Measured:
    """Return, by channel, rise (ms) and settled residual in its sweep (mm, mrad).

    The rise of a channel is withheld where the host was late in all of its steps.

    Raises:
        CannotBeMeasuredError: it is too short to evaluate.
    """
    command, hand = recording["command"], recording["hand"]
    residual, settled = residuals(recording)
    steps = find_steps(command.times, command.values)
    found: dict[str, dict[str, float]] = {}
    for channel in Channel:
        own = [step for step in steps if step.channel == channel]
        if len(own) != len(STEPS) + 1:
            raise CannotBeMeasuredError(
                f"{channel.label} has {len(own)} of {len(STEPS) + 1} steps; was the recording cut short?"
            )
        answers = [(step, respond(step, hand.times, hand.values[:, channel])) for step in own[1:-1]]
        parts = [answer.change / (step.after - step.before) for step, answer in answers]
        made = [answer for (_, answer), part in zip(answers, parts, strict=True) if part >= LEAST_PART]
        _, scale = display_unit(command.units[channel])
        mine = settled[:, channel] & (hand.times > own[0].start) & (hand.times < own[-1].start)
        in_time = [answer.rise for answer in made if answer.gap <= IN_TIME_S]
        found[channel.label] = {
            "tracking_rms": rms(scale * residual[mine, channel]) if mine.any() else np.nan,
        }
        if in_time or not made:
            found[channel.label]["rise_hand_ms"] = 1e3 * float(np.median(in_time)) if in_time else np.nan
    return found
