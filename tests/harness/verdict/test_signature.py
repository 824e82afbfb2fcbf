"""Signatures, with numbers known by hand."""

import pytest

from aero.channels import Channel
from hil.verdict.limits import Limit
from hil.verdict.signature import compressed, excesses, places, signature

PULL = Limit("audit", "pull", ("index", "ring"), "test", -1.0, 4.0, healthy=(0.0, 2.0))


def test_the_excess_of_every_judged_reading_that_was_measured_is_told():
    """Each limit lies 2 above and 1 below the healthy readings."""
    measured = {"audit": {"index": {"pull": 5.0, "followed": 9.0}, "ring": {"followed": 1.0}}}
    assert excesses(measured, [PULL]) == {("audit", "pull", "index"): 1.5}
    measured["audit"]["ring"]["pull"] = -3.0
    assert excesses(measured, [PULL]) == {("audit", "pull", "index"): 1.5, ("audit", "pull", "ring"): -3.0}
    assert excesses({}, [PULL]) == {}


def test_the_place_of_every_judged_reading_that_was_measured_is_told():
    """Half the range of the healthy readings is 1 about 1; of a given bound a fifth stands for it."""
    given = Limit("presence", "round_trip", ("hand",), "test", at_most=20.0)
    measured = {"audit": {"index": {"pull": 5.0}, "ring": {"pull": 0.5}}, "presence": {"hand": {"round_trip": 10.0}}}
    assert places(measured, [PULL, given]) == pytest.approx(
        {("audit", "pull", "index"): 4.0, ("audit", "pull", "ring"): -0.5, ("presence", "round_trip", "hand"): 2.5}
    )
    assert places({}, [PULL]) == {}


def test_a_place_is_compressed_up_to_a_thousand():
    """By the area sine of twice the place, 1.443635, 2.491780 and 8.294050, less 1."""
    assert compressed(1.0) == pytest.approx(0.443635, abs=1e-6)
    assert compressed(-3.0) == pytest.approx(-1.491780, abs=1e-6)
    assert compressed(1000.0) == compressed(1e9) == pytest.approx(7.294050, abs=1e-6)


def test_what_any_hand_reads_is_left_out():
    found = {("audit", "pull", "index"): 0.58, ("audit", "followed", "index"): -0.6}
    assert signature(found, "", Channel.INDEX) == {"own/audit/followed": pytest.approx(-0.015973, abs=1e-5)}


def test_how_a_run_ended_is_a_feature():
    assert signature({}, "OSError", None) == {"ended/OSError": pytest.approx(7.294050, abs=1e-6)}


def test_the_worst_reading_counts_whatever_its_sign():
    found = {
        ("audit", "pull", "index"): 3.0,
        ("audit", "pull", "middle"): -9.0,
        ("audit", "pull", "ring"): 5.0,
        ("audit", "pull", "hand"): 2.0,
    }
    whole = {"others/audit/pull": compressed(-9.0), "hand/audit/pull": compressed(2.0)}
    assert signature(found, "", None) == whole
    assert signature(found, "", Channel.INDEX) == {**whole, "own/audit/pull": compressed(3.0)}
