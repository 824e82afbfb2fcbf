"""Homing: how long it takes, and how well it finds the same zero again.

Asked for by name only: it drives every channel into its stop. Leaves `codes` and `command_codes`; the closures after
each homing show where its zero lies.
"""

from __future__ import annotations

import numpy as np

from aero.channels import CABLES, Channel
from hil.experiments.command_steps import find_steps
from hil.experiments.experiment import Driver, Experiment, Measured, last_before, map_of, one_closed
from hil.recordings.recorder import Progress
from hil.recordings.recording import Recording
from hil.targets.target import Target

HOMINGS = 3
HOLD_S = 0.9
REPEATS = "homed in "


def run(target: Target, progress: Progress) -> Recording:
    """Home a few times and close each cable channel after each homing."""
    driver = Driver(target, progress, HOMINGS * HOLD_S * 2 * len(CABLES))
    opened = np.zeros(len(Channel))
    for i in range(HOMINGS):
        start = target.clock.now()
        target.hand.home()
        driver.resume()
        driver.recorder.note(f"{REPEATS}{target.clock.now() - start:.2f} s")
        for channel in CABLES:
            driver.hold(one_closed(channel, 1.0), HOLD_S, f"homing {i + 1}, {channel.label}")
            driver.hold(opened, HOLD_S, f"homing {i + 1}, {channel.label}")
    return driver.recorder.finish("homing", {"homings": HOMINGS})


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
    times = [
        float(event.text.removeprefix(REPEATS).removesuffix(" s"))
        for event in recording.events
        if event.text.startswith(REPEATS)
    ]
    return found | {"hand": {"homing_time": max(times)}}


HOMING = Experiment("homing", "How long homing takes, and how well it repeats", run, measure, (1.0,) * 7)
