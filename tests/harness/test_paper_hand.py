"""The unit `paper`, homed by its firmware as the paper's hand was, reads what the paper published."""

from functools import cache

import pytest

from aero.channels import FINGERS
from hil.emulated.any_hand import open_target
from hil.report.beside_paper import text_rows
from hil.verdict.validation import validate


@cache
def validated(experiment):
    with open_target(unit="paper", firmware="pre", seed=0, homed=True) as target:
        return validate(target, [experiment])


def measured(experiment):
    return validated(experiment).results[experiment].measured


def test_no_finger_meets_the_thumb_in_the_fist():
    """44.45 mm (paper, Kinematic validation); a finger that lies on the thumb stops at 36 mm."""
    found = measured("excursion")
    assert [found[finger.label]["fist_travel"] for finger in FINGERS] == pytest.approx([44.45] * 4, abs=0.5)
    # The paper's differences are 0.04, 0.32, 1.40 and 0.41 mm.
    assert all(found[finger.label]["fist_difference"] < 0.5 for finger in FINGERS)


@pytest.mark.slow
def test_the_abduction_settles_and_rises_as_published():
    """26.79 mrad; 80 ms, and 120 ms on the fingers (paper, table of the dynamic validation)."""
    found = measured("staircase")
    assert found["thumb_abduction"]["tracking_rms"] == pytest.approx(26.79, abs=0.5)
    assert found["thumb_abduction"]["rise_hand_ms"] == pytest.approx(80, abs=5)
    assert [found[finger.label]["rise_hand_ms"] for finger in FINGERS] == pytest.approx([120] * 4, abs=5)


def test_the_excursions_stand_beside_the_papers():
    """The paper's |delta|, table of the validation: index 0.04, ring 1.40, CMC 5.42 mm, abduction 124.94 mrad."""
    found, rows = measured("excursion"), {row.name: row for row in text_rows(validated("excursion"))}
    for name, label, paper in (
        ("Index", "index", "0.04 mm"),
        ("Ring", "ring", "1.4 mm"),
        ("Thumb CMC flexion", "thumb_cmc_flexion", "5.42 mm"),
        ("Thumb abduction", "thumb_abduction", "124.94 mrad"),
    ):
        row = rows[f"{name}, excursion |Δ|"]
        assert row.paper == paper
        assert float(row.ours.split()[0]) == pytest.approx(found[label]["fist_difference"], rel=1e-3)
        assert row.note


@pytest.mark.slow
def test_the_cycle_is_slower_than_the_papers_and_says_why():
    """1.2 Hz (paper, Grasp diversity and fingertip force) needs a stroke in 0.4 s; the profile takes 0.9 s."""
    (row,) = [row for row in text_rows(validated("response")) if row.name == "Open-and-close cycle"]
    assert row.paper == "about 1.2 Hz"
    assert float(row.ours.split()[0]) == pytest.approx(0.57, abs=0.02)
    assert "motion profile" in row.note


@pytest.mark.slow
def test_repeated_closures_end_within_the_papers_3_mm():
    """3 mm of cable (paper, Repeatability); an emulated hand comes back to the count."""
    found = measured("repeatability")
    assert all(found[finger.label]["closure_spread"] < 0.05 for finger in FINGERS)
    (row,) = [row for row in text_rows(validated("repeatability")) if row.name == "Repeated closures to one posture"]
    assert row.paper == "within 3 mm of cable"
    assert "not modelled" in row.note
