"""Whole cases, played by an owner who knows what is shown: the part goes along with what is exchanged."""

import pytest
from owner import is_right, play, sees

from aero.channels import Channel
from hil.emulated.faults import parse_fault
from hil.verdict.part import Part
from hil.verdict.parts import Suspect


@pytest.mark.parametrize(
    ("fault", "convicted"),
    [
        pytest.param("reply_lost=0.05", Suspect(Part.USB), marks=pytest.mark.slow),
        pytest.param("supply_low=0.3", Suspect(Part.SUPPLY), marks=pytest.mark.slow),
        ("motor_dead:ring", Suspect(Part.SERVO, Channel.RING)),
        pytest.param("cable_snapped:ring", Suspect(Part.DIGIT, Channel.RING), marks=pytest.mark.slow),
    ],
)
def test_a_case_ends_with_the_part_at_fault(fault, convicted):
    played = play([parse_fault(fault)], "plausible:420007", 420007, "0.2.0", "right")
    assert played.case.convicted == convicted
    assert is_right(played.told[0], parse_fault(fault))


def test_a_good_part_is_not_right():
    fault = parse_fault("cable_snapped:ring")
    assert is_right(Suspect(Part.DIGIT, Channel.RING), fault)
    assert not is_right(Suspect(Part.SERVO, Channel.RING), fault)
    assert not is_right(Suspect(Part.DIGIT, Channel.INDEX), fault)


@pytest.mark.parametrize(
    ("shown", "differs"),
    [
        ("took everything out of the hand", True),
        ("there was nothing to take out of the hand", False),
        ("there was nothing to take out of the hand; looked at ring: nothing differs; looked at pinky: x", False),
        ("took everything out of the hand; looked at ring: it stops elsewhere; looked at pinky: nothing differs", True),
        ("7.40 V with the hand open, 6.90 V while the fingers close; the supply gives 7.4 V", True),
        ("7.40 V with the hand open, 7.30 V while the fingers close; the supply gives 7.4 V", False),
        ("flashed: 0.1.5, for a right hand; named: 0.2.0, for a right hand", True),
        ("flashed: 0.2.0, for a right hand; named: 0.2.0, for a right hand", False),
        ("read the registers: ring: kp is 12, 32 in the others", True),
        ("read the registers: nothing differs", False),
    ],
)
def test_an_answer_follows_from_what_is_shown(shown, differs):
    assert sees(shown) is differs


def test_what_homing_or_eyes_find_is_answered_by_what_the_hand_shows():
    played = play([parse_fault("digit_jammed:ring")], "plausible:420008", 420008, "0.1.5", "left")
    assert played.found
    assert any("bent ring: it bends with more resistance" in str(line) for line in played.shown)
    assert is_right(played.told[0], parse_fault("digit_jammed:ring"))
