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
from hil.checks.shared import subjects
from hil.checks.shared.command_steps import find_steps
from hil.checks.shared.experiment import Experiment, Measured, Metric
from hil.checks.shared.side_by_side import follow
from hil.checks.shared.signals import display_unit, rms
from hil.checks.staircase.reachable_range import calibrated_range, reachable
from hil.checks.staircase.rise_time import respond
from hil.checks.staircase.settled import residuals
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.target import Target
from model import RoutedHand

Floats = NDArray[np.float64]

GRASP = (0.5, 0.5, 0.5, 0.5, 0.5, 0.3, 0.4)
"""Part of each channel's range at the foot of the steps: a loose grasp in which no digit meets another."""
STEP = 0.05
"""Part of the range, as each of the paper's twenty levels."""
STEPS = (0, 1, 2, 1, 0)
"""Levels above the grasp, one after another, before the channel opens again."""
HOLD_S, LEAD_S = 0.6, 0.6
"""Time at each level, and at the open hand before the first, s; 0.4 s after a change a sample counts as settled."""
SAMPLE_PERIOD_S = 0.02
LEAST_PART = 0.5
"""Part of a step that has to be made for its rise to count: friction swallows some of those that turn back."""


def commands(open_lengths: Floats, closed_lengths: Floats) -> Floats:
    """Return the stream (n, 7) between where every channel waits and its closed end, both (7,); lengths, m and rad."""
    held = round(HOLD_S / SAMPLE_PERIOD_S)
    rows = [np.zeros((round(LEAD_S / SAMPLE_PERIOD_S), len(Channel)))]
    for channel, foot in zip(Channel, GRASP, strict=True):
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


_TRACKING = (
    "The channel does not come to rest where the simulator does: a wrong zero or window, a loose cable, friction."
)

METRICS = (
    Metric(
        "rise_hand_ms",
        "ms",
        subjects.CHANNELS,
        "The servo answers a step of 5 % slower than its gain, its speed and its motion profile allow, or too fast.",
        (
            "Slow on every channel: a low supply, a speed limit left from another program (restart the board), another "
            "firmware. Slow on one: friction, or a servo that is hot or of another kind."
        ),
    ),
    Metric(
        "tracking_rms",
        "mm",
        subjects.CABLES,
        _TRACKING,
        "Home the hand; if that does not help, run `aero-hil validate` and look at the channel's staircase.",
    ),
    Metric(
        "tracking_rms",
        "mrad",
        ("thumb_abduction",),
        _TRACKING,
        "173 mrad (9.93 degrees) are the wrong command window: home the hand, or name its firmware.",
    ),
    Metric("step_percent", "% of a step", subjects.CHANNELS, "Median part of its four steps that the channel made."),
)
"""What is measured, and what it means when it is off."""

EXPERIMENT = Experiment(
    "short_staircase",
    "Tracking and rise time of every channel in half a minute",
    run,
    measure,
    tuple(foot + STEP * max(STEPS) for foot in GRASP),
    METRICS,
    rank=65,
    by_default=False,
)
