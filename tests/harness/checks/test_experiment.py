"""What all experiments share, where no hand is needed."""

import numpy as np
import pytest

from aero.channels import Channel
from hil import open_target
from hil.checks import EXPERIMENTS
from hil.checks.shared.experiment import last_before, map_of, one_closed, record
from hil.checks.shared.signals import at_times, closing_current, display_unit, find_steps, rms
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
        "look": (0.5,) * 7,
        "repeatability": (0.5, 0.5, 0.5, 0.5, 0.5, 0.3, 0.4),
        "window": (*fingers, 0.35, 0.35, 0.35),
        "endurance": (1.0,) * 7,
        "homing": (1.0,) * 7,
    }


@pytest.mark.parametrize("subject", ["index", "thumb_abduction"])
def test_a_metric_is_that_of_its_subject(subject):
    metric = EXPERIMENTS["staircase"].metric("tracking_rms", subject)
    assert metric.name == "tracking_rms"
    assert metric.unit == {"index": "mm", "thumb_abduction": "mrad"}[subject]
    with pytest.raises(KeyError, match="audit does not measure friction on index"):
        EXPERIMENTS["audit"].metric("friction", "index")
    with pytest.raises(KeyError, match="tracking_rms on hand"):
        EXPERIMENTS["staircase"].metric("tracking_rms", "hand")


def test_the_last_sample_before_a_time_is_not_the_one_at_it():
    times, values = np.array([0.0, 1.0, 2.0]), np.array([[5.0], [6.0], [7.0]])
    assert [float(last_before(times, values, t)[0]) for t in (0.5, 1.0, 1.5, 9.0)] == [5.0, 5.0, 6.0, 7.0]
    with pytest.raises(ValueError, match=r"no sample before 0\.00 s"):
        last_before(times, values, 0.0)


def test_one_channel_is_closed_by_a_part_of_its_window():
    assert one_closed(Channel.RING, 0.5).tolist() == [0, 0, 32768, 0, 0, 0, 0]
    assert one_closed(Channel.INDEX, 1.0).tolist() == [65535, 0, 0, 0, 0, 0, 0]


def test_the_map_of_a_recording_is_that_of_its_header():
    codec = map_of(HEADER)
    assert (codec.window.name, codec.window.hand) == ("homed", "right")


def test_positive_current_closes():
    """All servos of a right hand but the flexor's; a left hand is mirrored."""
    assert closing_current(np.ones((2, 7)), "right").tolist() == [[1, 1, 1, 1, 1, 1, -1]] * 2
    assert closing_current(np.ones(7), "left").tolist() == [-1, -1, -1, -1, -1, -1, 1]


def test_signals_are_interpolated_scaled_and_squared():
    values = np.array([[0.0, 10.0], [1.0, 20.0]])
    np.testing.assert_allclose(at_times(np.array([0.0, 2.0]), values, np.array([0.5, 9.0])), [[0.25, 12.5], [1, 20]])
    assert display_unit("m") == ("mm", 1000.0)
    assert display_unit("rad") == ("mrad", 1000.0)
    assert rms(np.array([3.0, -4.0])) == pytest.approx(np.sqrt(12.5))
    assert np.isnan(rms(np.array([])))


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
