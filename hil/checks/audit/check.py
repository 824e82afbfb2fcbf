"""Channel audit: sign, amount and crosstalk of each channel's motion.

The expected signs come from the mechanism (`closing_current`), not from the map under test. Records `codes`,
`command_codes`, `currents` and `temperatures`.
"""

import numpy as np

from aero.actuation.window import fits_span
from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.shared.experiment import (
    OPENED,
    UNCLIPPED,
    Measured,
    Sampler,
    last_before,
    map_of,
    one_closed,
    require,
    unclipped,
)
from hil.checks.shared.signals import closing_current, find_steps
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.target import Target

NUDGE = 0.2
HALF_S = 0.6
"""Time at the nudge, and at the open hand after the nudge, s."""
FURTHEST = (NUDGE,) * 7
"""Largest commanded fraction of each channel's window, command order."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Close each channel a little and open it again."""
    recorder.begin({"nudge": NUDGE, "half_s": HALF_S, UNCLIPPED: unclipped(target.map)})
    driver = Sampler(target, recorder, progress, HALF_S * (1 + 2 * len(Channel)))
    driver.hold(OPENED, HALF_S, "open hand")
    for channel in Channel:
        driver.hold(one_closed(channel, NUDGE), HALF_S, channel.label)
        driver.hold(OPENED, HALF_S, channel.label)


def measure(recording: Recording) -> Measured:
    """Return each channel's own motion and that of the others, per cent of the nudge."""
    codes, commands, currents = (recording[name] for name in ("codes", "command_codes", "currents"))
    pull = closing_current(currents.values, recording.header.side)
    spans, readings = map_of(recording.header).window.spans_counts(), codes.values.astype(int)
    found: dict[str, dict[str, float]] = {}
    steps = find_steps(commands.times, commands.values)
    require(len(steps) == 2 * len(Channel), "nudges")
    for step in steps[::2]:
        start, nudged = (last_before(codes.times, codes.values, t) for t in (step.start, step.end))
        moved = (nudged - start) / (NUDGE * MAX_CODE) * 100.0
        others = np.delete(moved, step.channel)
        # Currents are sampled slowly, so the last sample before the opening command is used.
        before, pulled = (last_before(currents.times, pull, t)[step.channel] for t in (step.start, step.end))
        found[Channel(step.channel).label] = {
            "followed": float(moved[step.channel]),
            "others_moved": float(np.abs(others).max()),
            "pull": float(pulled - before),
            "quantum_fits": 100.0 * float(fits_span(readings[:, step.channel], spans[step.channel]).mean()),
        }
    return found
