"""Open-loop replay: one fixed action sequence on simulator and hand, without a policy in the loop.

Where simulator and hand agree, a gap under a policy comes from its feedback; where they differ, from the transmission.
The paper separates both with a logged rollout; this fixed sequence has the rates, nominal pose and scales of such a
rollout. Records the series of `follow`.
"""

import numpy as np

from aero.channels import Channel
from aero.floats import Floats
from aero.policy.settings import PAPER_TRAINING
from hil.checks.shared.experiment import Measured, require
from hil.checks.shared.side_by_side import follow
from hil.checks.shared.signals import MILLI, at_times
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.target import Target
from simulator.routed import RoutedHand

DURATION_S = 8.0
SETTLE_S = 1.0
"""Time at the nominal pose before the actions, s."""
RATES_HZ = (0.6, 0.7, 0.5, 0.8, 0.5, 0.65, 0.55)
AMPLITUDE = 0.4
"""Amplitude of one oscillation per channel, as in a gait; each rate differs and suits firmware with a motion profile.
"""
FURTHEST = (1.0,) * 7
"""Largest commanded fraction of each channel's window, command order."""
LONGEST_DELAY_S = 0.2
DELAY_STEP_S = 0.005
"""Step of the delay search, s."""
RESOLUTION = {"replay_delay": lambda _version, _subjects: MILLI * DELAY_STEP_S}


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Send the action sequence to the routed hand and to the target."""
    actions = _actions()
    commands = np.array(PAPER_TRAINING.nominal) + np.array(PAPER_TRAINING.scale) * actions
    follow(
        target,
        recorder,
        RoutedHand(target.side),
        commands,
        period_s=PAPER_TRAINING.period_s,
        parameters={"control_s": PAPER_TRAINING.period_s, "amplitude": AMPLITUDE},
        doing=lambda _: "replaying",
        progress=progress,
    )


def _actions() -> Floats:
    """Return the action sequence, (n, 7) in -1..1, zero until `SETTLE_S`."""
    t = PAPER_TRAINING.period_s * np.arange(round((SETTLE_S + DURATION_S) / PAPER_TRAINING.period_s))
    phase = 2.0 * np.pi * np.maximum(t - SETTLE_S, 0.0)[:, None] * np.array(RATES_HZ)
    actions: Floats = AMPLITUDE * np.sin(phase)
    return actions


def measure(recording: Recording) -> Measured:
    """Return, by channel, the hand's delay against the simulator (ms) and the remaining trace difference."""
    hand, model = recording["hand"], recording["model"]
    moving = hand.times > SETTLE_S + LONGEST_DELAY_S
    require(bool(moving.any()), "the motion")
    found = {}
    for channel in Channel:
        trace = MILLI * hand.values[moving, channel]
        delays = np.arange(-LONGEST_DELAY_S, LONGEST_DELAY_S, DELAY_STEP_S)
        errors = [
            trace - MILLI * at_times(model.times, model.values[:, [channel]], hand.times[moving] - delay)[:, 0]
            for delay in delays
        ]
        best = int(np.argmin([error.std() for error in errors]))
        found[channel.label] = {
            "replay_delay": round(1e3 * float(delays[best])),
            "replay_shape": float(errors[best].std()),
        }
    return found
