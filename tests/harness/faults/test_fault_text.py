"""A fault has one text, and what cannot be is refused with one line."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero import Channel
from hil.faults import CATALOGUE, Fault, parse_fault


@st.composite
def faults(draw):
    kind = CATALOGUE[draw(st.sampled_from(sorted(CATALOGUE)))]
    low, high = kind.bounds
    severity = draw(st.floats(low, min(high, 1e6), allow_subnormal=False))
    channel = draw(st.sampled_from(kind.subjects)) if kind.subjects else None
    at_s = draw(st.floats(0.0, 1e4, allow_subnormal=False)) if kind.later else 0.0
    return Fault(kind.name, severity, channel, at_s)


@given(faults())
def test_the_text_of_a_fault_is_read_back_as_the_same_fault(fault):
    # A time of its kind's own is what is meant where none is said.
    kind = CATALOGUE[fault.name]
    expected = fault if fault.at_s else Fault(fault.name, fault.severity, fault.channel, kind.at_s)
    assert parse_fault(str(fault)) == expected


def test_what_is_left_out_has_a_stated_value():
    assert parse_fault("encoder_scale") == Fault("encoder_scale", 1.05, Channel.INDEX)
    assert parse_fault("encoder_scale:ring=severe@20") == Fault("encoder_scale", 1.2, Channel.RING, 20.0)
    assert parse_fault("cable_snapped:thumb_flexor") == Fault("cable_snapped", 1.0, Channel.THUMB_FLEXOR)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "a fault is written"),
        ("gremlin", "there is no fault 'gremlin'"),
        ("motor_weak:toe", "there is no channel 'toe'"),
        ("motor_weak:index=a lot", "is not a severity"),
        ("motor_weak:index=nan", "goes from 0 to 0.99"),
        ("motor_weak:index=2", "goes from 0 to 0.99"),
        ("motor_dead=0.5", "is there or not"),
        ("motor_weak@soon", "is not a time"),
        ("motor_weak@-1", "begins at a time from 0 s on"),
        ("cable_snapped:thumb_abduction", "sits on index, middle"),
        ("supply_low:index", "has no channel"),
        ("winding_reversed@3", "cannot begin later"),
    ],
)
def test_what_cannot_be_is_refused_with_one_line(text, message):
    with pytest.raises(ValueError, match=message) as refused:
        parse_fault(text)
    assert "\n" not in str(refused.value)


def test_names_are_unique_and_every_kind_is_complete():
    for kind in CATALOGUE.values():
        assert kind.ids, kind.name
        assert kind.visible or kind.reason, kind.name
        for severity in kind.severities:
            kind.fault(severity)
