"""Homing: duration, and repeatability of the zero.

Runs only by name, because it drives every channel into its stop. Records `codes` and `command_codes`; closures after
each homing show the zero.
"""

import numpy as np

from aero.channels import CABLES
from hil.checks.shared.experiment import OPENED, Measured, Sampler, last_before, map_of, one_closed
from hil.checks.shared.signals import find_steps
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.target import Target

HOMINGS = 3
HOLD_S = 0.9
FURTHEST = (1.0,) * 7
"""Largest commanded fraction of each channel's window, command order."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Home several times, closing each cable channel after each homing."""
    recorder.begin({"homings": HOMINGS})
    driver = Sampler(target, recorder, progress, HOMINGS * HOLD_S * 2 * len(CABLES))
    seconds: list[float] = []
    for i in range(HOMINGS):
        start = target.clock.now()
        target.hand.home()
        driver.resume()
        seconds.append(target.clock.now() - start)
        recorder.note(f"homed in {seconds[-1]:.2f} s")
        for channel in CABLES:
            driver.hold(one_closed(channel, 1.0), HOLD_S, f"homing {i + 1}, {channel.label}")
            driver.hold(OPENED, HOLD_S, f"homing {i + 1}, {channel.label}")
    recorder.note_parameters(slowest_s=max(seconds))


def measure(recording: Recording) -> Measured:
    """Return the spread of each cable's closed end over the homings (mm)."""
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
    return found
