"""A short staircase: what tracking and rise time of every channel cost least, half a minute of hand time.

Each channel goes to a loose grasp, climbs two steps of 5 % of its range there, as the paper's staircase does, comes
down again and opens. Nothing meets a stop, so any firmware may run it, guarded or not. Five per cent tell most: a
servo's gain, its speed and its motion profile all show in such a step, and the hand's mechanics hardly do. Leaves what
`follow` leaves.
"""

from __future__ import annotations

import numpy as np

from aero.channels import Channel
from hil.checks.shared.experiment import LOOSE_GRASP, Measured
from hil.checks.shared.side_by_side import follow
from hil.checks.shared.signals import MILLI, find_steps, rms
from hil.checks.staircase.check import SAMPLE_PERIOD_S, stream
from hil.checks.staircase.reachable_range import calibrated_range, reachable
from hil.checks.staircase.rise_time import median_rise, respond
from hil.checks.staircase.tracking import residuals
from hil.recordings.errors import CannotBeMeasuredError
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.target import Target
from model import RoutedHand

STEP = 0.05
"""Part of the range, as each of the paper's twenty levels."""
STEPS = (0, 1, 2, 1, 0)
"""Levels above the grasp, one after another, before the channel opens again."""
HOLD_S, LEAD_S = 0.6, 0.6
"""Time at each level, and at the open hand before the first, s; 0.4 s after a change a sample counts as settled."""
FURTHEST = tuple(foot + STEP * max(STEPS) for foot in LOOSE_GRASP)
"""How far each channel is sent at most, part of its window, command order."""
STREAM = stream([[*(foot + STEP * step for step in STEPS), 0.0] for foot in LOOSE_GRASP], HOLD_S, LEAD_S)
LEAST_PART = 0.5
"""Part of a step that has to be made for its rise to count: friction swallows some of those that turn back."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Drive the target and the routed hand of its side through the steps."""
    simulator = RoutedHand(target.side)
    opened, closed = reachable(target.map, calibrated_range(simulator))
    follow(
        target,
        recorder,
        simulator,
        opened + STREAM * (closed - opened),
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
        made = [answer for step, answer in answers if answer.change / (step.after - step.before) >= LEAST_PART]
        mine = settled[:, channel] & (hand.times > own[0].start) & (hand.times < own[-1].start)
        row = found[channel.label] = {"tracking_rms": rms(MILLI * residual[mine, channel])}
        rise = median_rise(made)
        if not (made and np.isnan(rise)):
            row["rise_hand_ms"] = 1e3 * rise
    return found
