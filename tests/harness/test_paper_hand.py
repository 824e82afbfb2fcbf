"""The unit `paper`, homed by its firmware as the paper's hand was, reads what the paper published."""

import pytest

from aero.channels import FINGERS
from hil.checks import EXPERIMENTS
from hil.checks.shared.experiment import record
from hil.targets.opening import open_target


def measured(experiment, seed=0):
    with open_target(unit="paper", firmware="pre", seed=seed, homed=True) as target:
        return EXPERIMENTS[experiment].measure(record(EXPERIMENTS[experiment], target))


@pytest.mark.parametrize("seed", range(3))
def test_no_finger_meets_the_thumb_in_the_fist(seed):
    """44.45 mm (paper, Kinematic validation); a finger that lies on the thumb stops at 36 mm."""
    found = measured("excursion", seed)
    assert [found[finger.label]["fist_travel"] for finger in FINGERS] == pytest.approx([44.45] * 4, abs=0.5)
    # The paper's differences are 0.04, 0.32, 1.40 and 0.41 mm.
    assert all(found[finger.label]["fist_difference"] < 0.5 for finger in FINGERS)


def test_the_abduction_settles_and_rises_as_published():
    """26.79 mrad; 80 ms, and 120 ms on the fingers (paper, table of the dynamic validation)."""
    found = measured("staircase")
    assert found["thumb_abduction"]["tracking_rms"] == pytest.approx(26.79, abs=0.5)
    assert found["thumb_abduction"]["rise_hand_ms"] == pytest.approx(80, abs=5)
    assert [found[finger.label]["rise_hand_ms"] for finger in FINGERS] == pytest.approx([120] * 4, abs=5)
