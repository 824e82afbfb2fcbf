"""Channel audit: each command moves its own encoder, the right way, by the right amount, and no other.

The expected signs come from the mechanism (`closing_current`) and never from the map under test. Leaves `codes`,
`command_codes`, `currents` and `temperatures`.
"""

from __future__ import annotations

import numpy as np

from aero.channels import Channel
from hil.checks.shared.experiment import Sampler, one_closed
from hil.recordings.recorder import Progress, Recorder
from hil.targets.target import Target

NUDGE = 0.2
HALF_S = 0.6
"""Time at the nudge, and at the open hand after it, s."""
FURTHEST = (NUDGE,) * 7
"""How far each channel is sent at most, part of its window, command order."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Nudge each channel closed and open again."""
    recorder.begin({"nudge": NUDGE, "half_s": HALF_S})
    driver = Sampler(target, recorder, progress, HALF_S * (1 + 2 * len(Channel)))
    driver.hold(np.zeros(len(Channel)), HALF_S, "open hand")
    for channel in Channel:
        driver.hold(one_closed(channel, NUDGE), HALF_S, channel.label)
        driver.hold(np.zeros(len(Channel)), HALF_S, channel.label)
