"""A policy on an empty hand: in time, in bounds, not stopped, and every byte follows from what was read.

`--policy=NAME` runs another one than the shipped: a file, `FILE.onnx` or `package.module:factory`.
"""

from dataclasses import replace

import numpy as np
import pytest
from policies import playing
from policy_bytes import asked, fastest, frames_again, positions_sent
from quantities import assert_between

from aero.policy.running import Ending, RunSettings
from aero.policy.shipped import DEFAULT, find_policy
from hil.recordings.policy_run import record_policy
from hil.recordings.recorder import Recorder
from simulator.routed import COMMAND_RANGE

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
    rate_hz = result.run.steps / SECONDS
    assert result.run.steps == periods, f"rate of the policy {rate_hz:g} Hz, should be {1.0 / period_s:g} Hz"
    assert result.run.missing == 0, f"{result.run.missing} readings were missing, should be none"

    times = recording["command_codes"].times
    low, high = np.array([COMMAND_RANGE[channel] for channel in sorted(COMMAND_RANGE)]).T
    goals = recording["goal"].values
    assert_between("smallest commanded length", goals.min(axis=0), low, high, "m (rad)")
    assert_between("largest commanded length", goals.max(axis=0), low, high, "m (rad)")
    codes, _ = positions_sent(recording.wire)
    steps = np.abs(np.diff(codes, axis=0)).max(axis=0)
    assert_between("largest change of a command in one period", steps, 0, fastest(codec, period_s) + 1)
    most = np.ptp(codes, axis=0).max()
    assert most > 0.05 * 65535, f"largest range of a channel's commands {most} codes, should be more than 3277 codes"

    again = frames_again(policy, codec, recording["codes"].values, settings.correction, recording["currents"].values)
    sent = [record.data for record in recording.wire if record.direction == "to_hand" and record.data[:1] == b"\x11"]
    nominal = np.round(asked(codec, np.add(policy.settings.nominal, settings.correction)))
    reached = np.flatnonzero((codes == nominal).all(axis=1))
    nearest = codes[np.abs(codes - nominal).sum(axis=1).argmin()]
    assert reached.size, f"codes of the nominal grasp {nominal.tolist()} were never sent; nearest {nearest.tolist()}"
    made = sent[reached[0] + 1 : reached[0] + 1 + periods]
    other = [k for k, (ours, theirs) in enumerate(zip(made, again, strict=True)) if ours != theirs]
    assert not other, (
        f"{len(other)} of {periods} frames do not follow from the readings, the first in period {other[0]}"
    )

    held_up_s = max((delay.by_s for delay in recording.delays), default=0.0)
    if held_up_s > LATE_S:
        pytest.skip(f"this computer was held up for {1e3 * held_up_s:.0f} ms: the times of the periods are not judged")
    late_s = np.median(result.lateness_s)
    assert late_s < LATE_S, f"median lateness of a period {1e3 * late_s:.1f} ms, should be below {1e3 * LATE_S:g} ms"
    mean_s = (times[-1] - times[0]) / (periods - 1)
    assert mean_s == pytest.approx(period_s, rel=0.02), f"mean period {1e3 * mean_s:.1f} ms, not {1e3 * period_s:g} ms"


@pytest.mark.needs_ground_truth
@pytest.mark.parametrize("action", [-1.0, 1.0])
def test_a_policy_that_saturates_stays_in_its_windows_and_below_its_speed(target, hand, action):
    """Each action is at its bound, and each target as far beyond the window as ten grasps."""
    far = playing(np.full((20, 7), action))
    far = replace(far, settings=replace(far.settings, scale=tuple(10.0 * one for one in far.settings.scale)))
    recorder = Recorder(target, "policy")
    record_policy(target, recorder, far, RunSettings(seconds=1.0, approach_s=0.5, wait_s=0.1))
    codes, _ = positions_sent(recorder.finish().wire)
    steps = np.abs(np.diff(codes, axis=0)).max(axis=0)
    assert_between("largest change of a command", steps, 0, fastest(target.map, far.settings.period_s) + 1)
    assert_between("smallest code sent", codes.min(axis=0), 0, 65535)
    ends = np.isin(codes, (0, 65535)).any()
    assert ends, "no command at an end of a window, should be one"
