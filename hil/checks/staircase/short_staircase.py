"""Short staircase: cheapest test of tracking and rise time of every channel, half a minute of hand time.

Each channel goes to a loose grasp, makes two steps of 5 % of its range up and down, as in the paper's staircase, and
opens. No channel reaches a stop, so any firmware may run the test, guarded or not. Steps of 5 % are sensitive to a
servo's gain, speed and motion profile, and hardly to the hand's mechanics. Records the series of `follow`.
"""

import numpy as np

from aero.channels import Channel
from hil.checks.shared.experiment import LOOSE_GRASP, Measured
from hil.checks.shared.side_by_side import follow
from hil.checks.shared.signals import MILLI, find_steps, rms
from hil.checks.staircase.check import RESOLUTION, SAMPLE_PERIOD_S, stream
from hil.checks.staircase.reachable_range import calibrated_range, reachable
from hil.checks.staircase.rise_time import median_rise, respond
from hil.checks.staircase.tracking import residuals
from hil.recordings.errors import CannotBeMeasuredError
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.target import Target
from simulator.routed import RoutedHand

__all__ = ["FURTHEST", "RESOLUTION", "measure", "run"]

STEP = 0.05
"""Step height, fraction of the range; equal to one of the paper's twenty levels."""
STEPS = (0, 1, 2, 1, 0)
"""Sequence of levels above the grasp before the channel opens again."""
HOLD_S, LEAD_S = 0.6, 0.6
"""Time at each level, and at the open hand before the first, s; samples count as settled 0.4 s after a change."""
FURTHEST = tuple(foot + STEP * max(STEPS) for foot in LOOSE_GRASP)
"""Largest commanded fraction of each channel's window, command order."""
STREAM = stream([[*(foot + STEP * step for step in STEPS), 0.0] for foot in LOOSE_GRASP], HOLD_S, LEAD_S)
LEAST_PART = 0.5
"""Smallest completed fraction of a step whose rise counts; friction absorbs part of a reversing step."""


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
    """Return, by channel, rise (ms) and settled residual (mm, mrad) in its sweep.

    The rise of a channel is withheld if the host was late in all of its steps.

    Raises:
        CannotBeMeasuredError: the recording is too short.
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
