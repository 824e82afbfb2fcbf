"""Holding: currents and heating of a half closed hand that holds still.

Leaves `codes`, `command_codes`, `currents` and `temperatures`.
"""

from __future__ import annotations

import numpy as np

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.shared import subjects
from hil.checks.shared.closing_current import closing_current
from hil.checks.shared.experiment import Driver, Experiment, Measured, Metric
from hil.checks.shared.loose_grasp import LOOSE_GRASP
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.target import Target

OPEN_S, HOLD_S = 1.0, 8.0


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Hold the open hand, a loose grasp, and the open hand again."""
    recorder.begin({"open_s": OPEN_S, "hold_s": HOLD_S})
    driver = Driver(target, recorder, progress, 2 * OPEN_S + HOLD_S)
    opened = np.zeros(len(Channel))
    driver.hold(opened, OPEN_S, "open hand")
    driver.hold(MAX_CODE * np.array(LOOSE_GRASP), HOLD_S, "holding")
    driver.hold(opened, OPEN_S, "open hand")


def measure(recording: Recording) -> Measured:
    """Return each channel's holding current (A, positive closes), its drift, and its warming (degC)."""
    currents, temperatures, codes = (recording[name] for name in ("currents", "temperatures", "codes"))
    pull = closing_current(currents.values, recording.header.hand)
    held = (currents.times > OPEN_S + 1.0) & (currents.times < OPEN_S + HOLD_S)
    still = (codes.times > OPEN_S + 1.0) & (codes.times < OPEN_S + HOLD_S)
    return {
        channel.label: {
            "holding_current": float(np.median(pull[held, channel])),
            "creep_percent": 100.0 * float(np.ptp(codes.values[still, channel])) / MAX_CODE,
            "warming": float(temperatures.values[-1, channel] - temperatures.values[0, channel]),
        }
        for channel in Channel
    }


METRICS = (
    Metric(
        "creep_percent",
        "% of the window",
        subjects.CHANNELS,
        "The channel does not hold still under its own spring.",
        "Look for a servo that overheats, a supply that sags, or a cable that slips on its spool.",
    ),
    Metric(
        "holding_current",
        "A",
        subjects.FINGERS,
        "Too little: nothing pulls back. Too much: friction or a blocked digit.",
        "Compare with the staircase's spring load and friction of the same channel.",
    ),
    Metric(
        "warming",
        "degC",
        subjects.CHANNELS,
        "The servo heats faster than its current explains.",
        "Check that its case is not enclosed; compare the currents with the neighbours'.",
    ),
    Metric(
        "holding_current",
        "A",
        subjects.THUMB,
        "The thumb holds its grasp with another current than a good hand's.",
        "Compare with the staircase's spring load and friction of the same channel.",
    ),
)
"""What is measured, and what it means when it is off."""

EXPERIMENT = Experiment(
    "holding", "Currents and heating while the hand holds still", run, measure, LOOSE_GRASP, METRICS, rank=60
)
