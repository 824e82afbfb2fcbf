"""Whole cases, played by an owner who knows what is shown: the part goes along with what is exchanged."""

import pytest
from owner import differs, is_right, play

from aero.channels import Channel
from hil.emulated.faults import parse_fault
from hil.verdict.noticed import Differences, Flashed, Removed, Voltages
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
    assert played.told == (convicted,)
    assert is_right(played.told[0], parse_fault(fault))


def test_a_good_part_is_not_right():
    fault = parse_fault("cable_snapped:ring")
    assert is_right(Suspect(Part.DIGIT, Channel.RING), fault)
    assert not is_right(Suspect(Part.SERVO, Channel.RING), fault)
    assert not is_right(Suspect(Part.DIGIT, Channel.INDEX), fault)


@pytest.mark.parametrize(
    ("noticed", "yes"),
    [
        (Removed(True), True),
        (Removed(False), False),
        (Differences("bent", {"ring": (), "pinky": ("it stops elsewhere",)}), False),
        (Differences("bent", {"ring": ("it stops elsewhere",), "pinky": ()}), True),
        (Voltages(7.4, 6.9, 7.4), True),
        (Voltages(7.4, 7.3, 7.4), False),
        (Flashed("0.1.5", "right", "0.2.0", "right"), True),
        (Flashed("0.2.0", "right", "0.2.0", "right"), False),
    ],
    ids=str,
)
def test_an_answer_follows_from_what_is_noticed(noticed, yes):
    assert differs(noticed) is yes


@pytest.mark.slow
def test_what_homing_or_eyes_find_is_answered_by_what_the_hand_shows():
    played = play([parse_fault("digit_jammed:ring")], "plausible:420008", 420008, "0.1.5", "left")
    assert played.found
    assert any("bent ring: it bends with more resistance" in str(line) for line in played.shown)
    assert is_right(played.told[0], parse_fault("digit_jammed:ring"))
