"""What a reference says of a run: shares that add up, no favour to any channel, and none of these when none is."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import FINGERS, Channel
from hil.faults import parse_fault
from hil.verdict.causes import CAUSES
from hil.verdict.dictionary import Entry
from hil.verdict.ending import EndSignature
from hil.verdict.explanation import Place
from hil.verdict.reference import MISSED, Trust, load_reference
from tests.support.references import TRUST, reference_of

STIFF = Entry("gear_friction", parse_fault("gear_friction:index=0.2"), {"own/staircase/friction": 4.0})
SLACK = Entry("cable_snapped", parse_fault("cable_snapped:index"), {"own/staircase/take_up": 4.0})
SUPPLY = Entry("supply_low", parse_fault("supply_low=0.4"), {"others/staircase/friction": 3.0})
SILENT = Entry("link_silent", parse_fault("link_silent=30"), {"hand/ended/LinkTimeoutError": 7.3})
REFERENCE = reference_of((STIFF, SLACK, SUPPLY, SILENT))
SHIPPED = load_reference()

METRICS = ("friction", "take_up", "spring")
READINGS = st.dictionaries(
    st.tuples(st.just("staircase"), st.sampled_from(METRICS), st.sampled_from([c.label for c in FINGERS])),
    st.floats(-200, 200),
    max_size=12,
)


def on(channel, metric, place):
    """Return a run in which one reading of one channel is off."""
    healthy = {("staircase", name, c.label): 0.0 for name in METRICS for c in Channel}
    return healthy | {("staircase", metric, channel.label): place}


def label(channel):
    return None if channel is None else channel.label


@pytest.mark.parametrize("reference", [REFERENCE, SHIPPED], ids=["by hand", "shipped"])
@given(READINGS, st.sampled_from(["", "LinkTimeoutError", "SafetyStopError"]))
def test_shares_are_shares_and_add_up_to_one_at_most(reference, found, error):
    told = reference.diagnosed({**found, **EndSignature(error).places}, {})
    for shares in (told.where, told.effects, told.causes):
        assert all(-1e-12 <= one.probability <= 1.0 + 1e-9 for one in shares)
        assert all(one.probability >= other.probability for one, other in pairwise(shares))
        assert sum(one.probability for one in shares) <= 1.0 + 1e-6
    assert sum(one.probability for one in told.where) == pytest.approx(1.0)
    assert {one.channel is None for one in told.where if one.place is Place.ONE_CHANNEL} == {False}


@given(READINGS, st.permutations(FINGERS))
def test_no_finger_is_favoured(found, order):
    """A run whose fingers are exchanged is explained alike, with the fingers exchanged."""
    other = dict(zip((c.label for c in FINGERS), (c.label for c in order), strict=True))
    moved = {(experiment, metric, other[subject]): place for (experiment, metric, subject), place in found.items()}
    before, after = REFERENCE.diagnosed(found, {}), REFERENCE.diagnosed(moved, {})
    shares = {(one.place, other.get(label(one.channel), label(one.channel))): one.probability for one in before.where}
    for one in after.where:
        assert one.probability == pytest.approx(shares[one.place, label(one.channel)], abs=1e-9)
    assert {c.cause: c.probability for c in before.causes} == pytest.approx(
        {c.cause: c.probability for c in after.causes}, abs=1e-9
    )


@given(st.sampled_from(list(Channel)), st.sampled_from(METRICS), st.floats(20, 900), st.sampled_from([-1, 1]))
def test_one_channel_that_is_off_never_blames_the_whole_hand(channel, metric, place, sign):
    for reference in (REFERENCE, SHIPPED):
        first = reference.diagnosed(on(channel, metric, sign * place), {}).where[0]
        assert (first.place, first.channel) == (Place.ONE_CHANNEL, channel)


@given(st.sampled_from(FINGERS), st.floats(3, 200))
def test_a_fault_that_was_learned_on_one_finger_is_known_on_all_in_any_severity(finger, place):
    told = REFERENCE.diagnosed(on(finger, "friction", place), {})
    assert (told.causes[0].cause, told.causes[0].channel) == ("gear_friction", finger)
    assert told.shown == ("gear_friction",)


def test_what_all_channels_share_is_no_fault_of_one():
    everywhere = {("staircase", "friction", channel.label): 30.0 for channel in Channel}
    told = REFERENCE.diagnosed(everywhere, {})
    assert told.causes[0].cause == "supply_low"
    assert told.where[0].place in (Place.SUPPLY, Place.SEVERAL_CHANNELS)


def test_a_run_unlike_anything_known_is_told_so():
    told = REFERENCE.diagnosed(on(Channel.RING, "spring", 60.0), {})
    assert told.shown == ()
    assert told.unlike_anything_known
    assert told.where[0].channel is Channel.RING
    assert sum(cause.probability for cause in told.causes) < 0.05


def test_how_a_run_ended_is_evidence():
    told = REFERENCE.diagnosed(EndSignature("LinkTimeoutError").places, {})
    assert told.causes[0].cause == "link_silent"
    assert told.where[0].place is Place.LINK


@given(st.floats(0, 1), st.integers(1, 60))
def test_the_shown_set_leaves_out_shares_that_the_right_cause_hardly_ever_has(share, hands):
    """Of n hands and the run itself, all as likely to have the least share, it keeps the best 90 %."""
    right = tuple(i / hands for i in range(hands))
    smaller = sum(one <= share for one in right)
    assert Trust(right, 0.2, (1.0, 0.0)).shows(share) == ((1 + smaller) / (hands + 1) > MISSED)


def test_a_share_of_known_kinds_rises_with_what_the_best_explains():
    assert TRUST.known(0.5) == pytest.approx(0.5)
    assert TRUST.known(1.0) == pytest.approx(1 / (1 + math.exp(-4)))


def test_what_ships_knows_every_cause_that_a_campaign_found():
    assert {entry.cause for entry in SHIPPED.known.entries} <= CAUSES.keys()
    assert len({entry.cause for entry in SHIPPED.known.entries}) >= 50
