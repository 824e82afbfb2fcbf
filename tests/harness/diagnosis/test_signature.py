"""Signatures, with numbers known by hand."""

import math

import pytest

from aero.channels import Channel
from hil.diagnosis.signature import KINDS, compressed, excesses, signature
from hil.judging.limits import Limit

PULL = Limit("audit", "pull", ("index", "ring"), "test", -1.0, 4.0, healthy=(0.0, 2.0))


def test_the_excess_of_every_judged_reading_that_was_measured_is_told():
    """Each limit lies 2 above and 1 below the healthy readings."""
    measured = {"audit": {"index": {"pull": 5.0, "followed": 9.0}, "ring": {"followed": 1.0}}}
    assert excesses(measured, [PULL]) == {("audit", "pull", "index"): 1.5}
    measured["audit"]["ring"]["pull"] = -3.0
    assert excesses(measured, [PULL]) == {("audit", "pull", "index"): 1.5, ("audit", "pull", "ring"): -3.0}
    assert excesses({}, [PULL]) == {}


def test_an_excess_is_compressed_up_to_twenty():
    assert compressed(1.0) == pytest.approx(math.log(2))
    assert compressed(-3.0) == pytest.approx(-math.log(4))
    assert compressed(20.0) == compressed(1e9) == pytest.approx(math.log(21))
    assert compressed(19.0) == pytest.approx(math.log(20))


def test_small_excesses_are_left_out():
    """An excess of 0.4918 is 0.4 when compressed."""
    found = {("audit", "pull", "index"): 0.49, ("audit", "followed", "index"): -0.495}
    assert signature(found, "", (), Channel.INDEX) == {"own/audit/followed": pytest.approx(-0.40213, abs=1e-5)}


def test_how_a_run_ended_is_a_feature():
    seen = signature({}, "OSError", ("replay", "audit"), None)
    assert seen == pytest.approx(
        {"not run/replay": math.log(2), "not run/audit": math.log(2), "ended/OSError": math.log(4)}
    )


def test_the_worst_reading_counts_whatever_its_sign():
    found = {
        ("audit", "pull", "index"): 3.0,
        ("audit", "pull", "middle"): -9.0,
        ("audit", "pull", "ring"): 5.0,
        ("audit", "pull", "hand"): 2.0,
    }
    whole = {"others/audit/pull": -math.log(10), "hand/audit/pull": math.log(3)}
    assert signature(found, "", (), None) == pytest.approx(whole)
    assert signature(found, "", (), Channel.INDEX) == pytest.approx({**whole, "own/audit/pull": math.log(4)})


def test_fingers_are_alike_and_the_thumbs_channels_are_not():
    fingers, thumb = list(KINDS.values())[:4], list(KINDS.values())[4:]
    assert fingers == ["finger"] * 4
    assert thumb == ["thumb_abduction", "thumb_cmc_flexion", "thumb_flexor"]
