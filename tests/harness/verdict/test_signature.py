"""A signature sees a run from one channel, and says how far readings lie from those of healthy hands."""

from hypothesis import given
from hypothesis import strategies as st

from aero.channels import Channel
from hil.verdict.ending import EndSignature
from hil.verdict.signature import MOST, compressed, signature


@given(st.floats(-1000, 1000))
def test_compression_keeps_the_sign_and_the_order(place):
    assert compressed(place) * place >= 0.0
    assert abs(compressed(place)) <= abs(compressed(2 * place))


@given(st.floats(-0.5, 0.5))
def test_what_any_hand_reads_is_no_feature(place):
    assert compressed(place) == 0.0


def test_a_signature_sees_the_own_channel_and_the_worst_of_the_others():
    found = {
        ("audit", "followed", "index"): -4.0,
        ("audit", "followed", "ring"): 2.0,
        ("audit", "followed", "pinky"): -9.0,
        ("presence", "round_trip", "hand"): 3.0,
        **EndSignature("LinkTimeoutError").places,
    }
    seen = signature(found, Channel.INDEX)
    assert seen["own/audit/followed"] == compressed(-4.0)
    assert seen["others/audit/followed"] == compressed(-9.0)
    assert seen["hand/presence/round_trip"] == compressed(3.0)
    assert seen["hand/ended/LinkTimeoutError"] == compressed(MOST)
