"""A policy on an empty hand: in time, in bounds, not stopped, and every byte follows from what was read.

`--policy=NAME` runs another one than the shipped: a file, `FILE.onnx` or `package.module:factory`.
"""

import numpy as np
import pytest
from policy_bytes import asked, fastest, frames_again, positions_sent

from aero.policy.running import Ending, RunSettings
from aero.policy.shipped import DEFAULT, find_policy
from hil.recordings.policy_run import record_policy
from hil.recordings.recorder import Recorder
from model.routed import COMMAND_RANGE

pytestmark = pytest.mark.moves

SECONDS = 5.0
LATE_S = 0.02
"""By what the median period may begin late, s: a telemetry cycle of the slowest firmware."""


def test_a_policy_turns_nothing_for_five_seconds(target, hand, request):
    policy, codec = find_policy(request.config.getoption("--policy", DEFAULT)), target.map
    period_s = policy.settings.period_s
    periods = round(SECONDS / period_s)
    recorder = Recorder(target, "policy")
    settings = RunSettings(seconds=SECONDS, approach_s=1.0, wait_s=0.3)
    result = record_policy(target, recorder, policy, settings)
    recording = recorder.finish()

    assert result.run.ending is Ending.TIME, result.run.reason
    assert (result.run.steps, result.run.missing) == (periods, 0)

    times = recording["command_codes"].times
    low, high = np.array([COMMAND_RANGE[channel] for channel in sorted(COMMAND_RANGE)]).T
    goals = recording["goal"].values
    assert ((low <= goals) & (goals <= high)).all()
    codes, _ = positions_sent(recording.wire)
    steps = np.abs(np.diff(codes, axis=0))
    assert (steps <= fastest(codec, period_s) + 1).all()
    assert np.ptp(codes, axis=0).max() > 0.05 * 65535

    again = frames_again(policy, codec, recording["codes"].values, settings.correction, recording["currents"].values)
    sent = [record.data for record in recording.wire if record.direction == "to_hand" and record.data[:1] == b"\x11"]
    nominal = np.round(asked(codec, np.add(policy.settings.nominal, settings.correction)))
    grasp = next(i for i, row in enumerate(codes) if (row == nominal).all())
    assert sent[grasp + 1 : grasp + 1 + periods] == again

    held_up_s = max((delay.by_s for delay in recording.delays), default=0.0)
    if held_up_s > LATE_S:
        pytest.skip(f"this computer was held up for {1e3 * held_up_s:.0f} ms: the times of the periods are not judged")
    assert np.median(result.lateness_s) < LATE_S
    assert (times[-1] - times[0]) / (periods - 1) == pytest.approx(period_s, rel=0.02)
