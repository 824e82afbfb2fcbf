"""Homing: how long it takes, and how well it finds the same zero again.

Asked for by name only: it drives every channel into its stop. Leaves `codes` and `command_codes`; the closures after
each homing show where its zero lies.
"""

from __future__ import annotations

import numpy as np

from aero.channels import CABLES, Channel
from hil.checks.shared import subjects
from hil.checks.shared.command_steps import find_steps
from hil.checks.shared.experiment import Driver, Experiment, Measured, Metric, last_before, map_of, one_closed
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.target import Target

HOMINGS = 3
HOLD_S = 0.9


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Home a few times and close each cable channel after each homing."""
    recorder.begin({"homings": HOMINGS})
    driver = Driver(target, recorder, progress, HOMINGS * HOLD_S * 2 * len(CABLES))
    opened = np.zeros(len(Channel))
    seconds: list[float] = []
    for i in range(HOMINGS):
        start = target.clock.now()
        target.hand.home()
        driver.resume()
        seconds.append(target.clock.now() - start)
        recorder.note(f"homed in {seconds[-1]:.2f} s")
        for channel in CABLES:
            driver.hold(one_closed(channel, 1.0), HOLD_S, f"homing {i + 1}, {channel.label}")
            driver.hold(opened, HOLD_S, f"homing {i + 1}, {channel.label}")
    recorder.note_parameters(slowest_s=max(seconds))


def measure(recording: Recording) -> Measured:
    """Return the time of the slowest homing (s), and by how much each cable's closed end came out differently (mm)."""
    codes, commands = recording["codes"], recording["command_codes"]
    codec = map_of(recording.header)
    found: dict[str, dict[str, float]] = {}
    for channel in CABLES:
        openings = [
            step
            for step in find_steps(commands.times, commands.values)
            if step.channel == channel and step.after < step.before
        ]
        closed = np.array([last_before(codes.times, codes.values, step.start) for step in openings]).astype(int)
        travel = codec.travel_from_angles(codec.angles_from_codes(closed))[:, channel]
        found[channel.label] = {"homing_spread": 1e3 * float(np.ptp(travel))}
    return found | {"hand": {"homing_time": float(recording.header.parameters["slowest_s"])}}


METRICS = (
    Metric(
        "homing_spread",
        "mm",
        subjects.CABLES,
        "Homing finds another zero each time: something gives way at the stop, or the search ended early.",
        (
            "Watch a homing: each digit must be free until it is fully closed. A digit that meets another "
            "stops the search."
        ),
    ),
    Metric(
        "homing_time",
        "s",
        subjects.HAND,
        (
            "Homing takes another time than this firmware's: another version is on the board, or a search "
            "timed out because its channel never met a stop."
        ),
        (
            "About 4 s mean firmware 0.1.3 or later, 20-60 s mean 0.1.2 or before. Otherwise watch which "
            "digit does not close, and look for its cable."
        ),
    ),
)
"""What is measured, and what it means when it is off."""

EXPERIMENT = Experiment(
    "homing",
    "How long homing takes, and how well it repeats",
    run,
    measure,
    (1.0,) * 7,
    METRICS,
    rank=90,
    by_default=False,
)
