"""A fault has one text, and what cannot be is refused with one line."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero import Channel
from hil.emulated.faults import CATALOGUE, parse_fault


@st.composite
def faults(draw):
    fault = CATALOGUE[draw(st.sampled_from(sorted(CATALOGUE)))]
    low, high = (1.0, 1.0) if fault.severity is None else (fault.severity.low, fault.severity.high)
    severity = draw(st.floats(low, min(high, 1e6), allow_subnormal=False))
    channel = draw(st.sampled_from(fault.channels)) if fault.channels else None
    return fault.at(severity, channel, draw(st.floats(0.0, 1e4, allow_subnormal=False)) if fault.later else 0.0)


@given(faults())
def test_the_text_of_a_fault_is_read_back_as_the_same_fault(fault):
    # The fault's own time is what is meant where none is said.
    expected = fault if fault.at_s else fault.fault.at(fault.severity, fault.channel)
    assert parse_fault(str(fault)) == expected


def test_what_is_left_out_has_a_stated_value():
    assert parse_fault("encoder_scale") == CATALOGUE["encoder_scale"].at(1.05, Channel.INDEX)
    assert parse_fault("encoder_scale:ring=severe@20") == CATALOGUE["encoder_scale"].at(1.2, Channel.RING, 20.0)
    assert parse_fault("cable_snapped:thumb_flexor") == CATALOGUE["cable_snapped"].at(1.0, Channel.THUMB_FLEXOR)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "a fault is written"),
        ("gremlin", "unknown fault 'gremlin'"),
        ("motor_weak:toe", "unknown channel 'toe'"),
        ("motor_weak:index=a lot", "is not a severity"),
        ("motor_weak:index=nan", "goes from 0 to 0.99"),
        ("motor_weak:index=2", "goes from 0 to 0.99"),
        ("motor_dead=0.5", "has no severity"),
        ("motor_weak@soon", "is not a time"),
        ("motor_weak@-1", "needs a start time of at least 0 s"),
        ("cable_snapped:thumb_abduction", "sits on index, middle"),
        ("supply_low:index", "has no channel"),
        ("winding_reversed@3", "cannot begin later"),
    ],
)
def test_what_cannot_be_is_refused_with_one_line(text, message):
    with pytest.raises(ValueError, match=message) as refused:
        parse_fault(text)
    assert "\n" not in str(refused.value)


def test_every_step_of_every_fault_is_possible():
    for fault in CATALOGUE.values():
        assert [fault.at(severity).severity for severity in fault.steps()] == [*fault.steps()]
