"""Whole cases, played by an emulated owner: the part goes along with what the owner exchanges."""

import pytest
from owner import is_right, play

from aero.channels import Channel
from hil.faults import parse_fault
from hil.verdict.parts import Part, Suspect


@pytest.mark.parametrize(
    ("fault", "convicted"),
    [
        ("reply_lost=0.05", Suspect(Part.USB)),
        pytest.param("supply_low=0.3", Suspect(Part.SUPPLY), marks=pytest.mark.slow),
        pytest.param("motor_dead:ring", Suspect(Part.SERVO, Channel.RING), marks=pytest.mark.slow),
        pytest.param("cable_snapped:ring", Suspect(Part.DIGIT, Channel.RING), marks=pytest.mark.slow),
    ],
)
def test_a_case_ends_with_the_part_at_fault(fault, convicted):
    played = play([parse_fault(fault)], "plausible:420007", 420007, "0.2.0", "right")
    assert played.case.convicted == convicted
    assert played.right
    assert len(played.case.done) <= 4


def test_a_good_part_is_not_right():
    fault = parse_fault("cable_snapped:ring")
    assert is_right(Suspect(Part.DIGIT, Channel.RING), fault)
    assert not is_right(Suspect(Part.SERVO, Channel.RING), fault)
    assert not is_right(Suspect(Part.DIGIT, Channel.INDEX), fault)
