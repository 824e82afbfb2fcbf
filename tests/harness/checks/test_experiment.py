"""What all experiments share, where no hand is needed."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil.checks import EXPERIMENTS
from hil.checks.shared.experiment import Sampler, map_of, record
from hil.checks.shared.signals import find_steps
from hil.emulated.any_hand import open_target
from hil.recordings.recorder import Recorder, silent
from model.units.conditions import Conditions
from tests.support.synthetic import HEADER


def test_how_far_each_experiment_goes_is_known():
    """The guard is told by it which stops a channel may meet."""
    fingers, thumb = (1.0,) * 4, (0.0, 0.0, 0.0)
    assert {name: experiment.furthest for name, experiment in EXPERIMENTS.items()} == {
        "presence": (0.0,) * 7,
        "audit": (0.2,) * 7,
        "excursion": (1.0,) * 7,
        "response": fingers + thumb,
        "coupling": (0.0,) * 4 + (1.0, 1.0, 0.0),
        "holding": (0.5, 0.5, 0.5, 0.5, 0.5, 0.3, 0.4),
        "short_staircase": (0.6, 0.6, 0.6, 0.6, 0.6, 0.4, 0.5),
        "staircase": (1.0,) * 7,
        "replay": (1.0,) * 7,
        "drift": fingers + thumb,
        "look": (0.5,) * 7,
        "repeatability": (0.5, 0.5, 0.5, 0.5, 0.5, 0.3, 0.4),
        "window": (*fingers, 0.35, 0.35, 0.35),
        "endurance": (1.0,) * 7,
        "homing": (1.0,) * 7,
    }


@pytest.mark.parametrize(("plan", "of"), [("short_staircase", "staircase"), ("endurance", "repeatability")])
def test_another_plan_measures_what_its_check_does_and_has_nothing_of_the_paper(plan, of):
    metrics = EXPERIMENTS[plan].metrics
    assert {metric.name for metric in metrics} <= {metric.name for metric in EXPERIMENTS[of].metrics}
    assert all(bound.experiment == plan for metric in metrics for bound in metric.bounds)
    assert not any(metric.column or metric.paper or metric.published or metric.worse for metric in metrics)


@pytest.mark.parametrize("subject", ["index", "thumb_abduction"])
def test_a_metric_is_that_of_its_subject(subject):
    metric = EXPERIMENTS["staircase"].metric("tracking_rms", subject)
    assert metric.name == "tracking_rms"
    assert metric.unit == {"index": "mm", "thumb_abduction": "mrad"}[subject]
    with pytest.raises(KeyError, match="audit does not measure friction on index"):
        EXPERIMENTS["audit"].metric("friction", "index")
    with pytest.raises(KeyError, match="tracking_rms on hand"):
        EXPERIMENTS["staircase"].metric("tracking_rms", "hand")


def test_the_map_of_a_recording_is_that_of_its_header():
    codec = map_of(HEADER)
    assert (codec.window.name, codec.window.side) == ("homed", "right")


def test_a_late_host_leaves_out_samples_and_keeps_to_the_plan():
    """Each write is 6 to 12 ms late, so that a sample with its currents takes more than its 20 ms."""
    with open_target(conditions=Conditions(late_s=0.012)) as target:
        recording = record(EXPERIMENTS["audit"], target)
    starts = [step.start for step in find_steps(recording["command_codes"].times, recording["command_codes"].values)]
    np.testing.assert_allclose(np.diff(starts), 0.6, atol=0.045)
    assert recording["codes"].times[-1] == pytest.approx(9.0, abs=0.06)
    assert len(recording["codes"].times) < 450


def test_a_hold_after_a_stall_has_its_whole_time(monkeypatch):
    """As found beside four spinning processes: after 1 s without a core the pinky was told to close for 0.1 s."""
    with open_target() as target:
        clock, read = target.clock, target.hand.read_codes
        stalls = iter([0.0] * 100 + [1.0])
        monkeypatch.setattr(
            target.hand, "read_codes", lambda: (clock.sleep_until(clock.now() + next(stalls, 0.0)), read())[1]
        )
        recording = record(EXPERIMENTS["excursion"], target)
    steps = find_steps(recording["command_codes"].times, recording["command_codes"].values)
    first = [next(step for step in steps if step.channel == channel) for channel in range(4)]
    assert all(step.end - step.start > 0.85 for step in first)


@given(st.integers(0, 30), st.floats(0.0, 0.095))
@settings(max_examples=15)
def test_each_hold_has_a_sample_at_its_last_instant_whatever_the_stall(before, stall_s):
    with open_target() as target:
        recorder, read, clock = Recorder(target, "audit"), target.hand.read_codes, target.clock
        stalls = iter([0.0] * before + [stall_s])
        target.hand.read_codes = lambda: (clock.sleep_until(clock.now() + next(stalls, 0.0)), read())[1]
        recorder.begin()
        sampler = Sampler(target, recorder, silent, 1.2)
        for codes in (1000, 2000):
            sampler.hold([codes] * 7, 0.6, "holds")
        recording = recorder.finish()
    commands = recording["command_codes"]
    first, second = (commands.times[commands.values[:, 0] == codes] for codes in (1000, 2000))
    assert 0.58 - 1e-6 <= first[-1] <= 0.58 + stall_s + 0.01
    # What the first hold lost, the second has caught up.
    assert second[-1] == pytest.approx(1.18, abs=0.01)
