"""Whole cases, played by an owner who knows what is shown: the part goes along with what is exchanged."""

import pytest
from figures.strangers.helpers import linked, passing
from owner import Slip, differs, is_right, play

from aero.channels import Channel
from aero.protocol import Opcode
from hil.emulated.faults import parse_fault
from hil.verdict.noticed import Differences, Flashed, Removed, Voltages
from hil.verdict.part import Part
from hil.verdict.parts import Suspect
from hil.verdict.steps import StepOutcome


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


@pytest.mark.slow
@pytest.mark.parametrize("slip", Slip)
def test_an_owner_who_makes_a_mistake_convicts_no_good_part(slip):
    """Servos that kept their IDs convicted a good digit, after 39 minutes, to be taken apart."""
    fault = parse_fault("motor_dead:ring")
    played = play([fault], "plausible:420007", 420007, "0.2.0", "right", slip=slip)
    assert played.found
    assert all(is_right(suspect, fault) for suspect in played.told)
    if slip is not Slip.WRONG_ANSWER:
        (done,) = (one for one in played.case.done if one.proposal.step.name == "exchange")
        assert {*done.outcomes} == {StepOutcome.UNSURE}
        assert done.note


@pytest.mark.slow
def test_a_lost_acknowledgement_hides_no_weak_motor():
    """A board and a supply were bought for a servo, and nobody remained."""
    weak = parse_fault("motor_weak:middle=0.5")
    lost = linked("ack_lost", Part.USB, "one acknowledgement is lost", passing("from_hand", once_lost)).at()
    played = play([weak, lost], "plausible:420007", 420007, "0.2.0", "right")
    assert played.told == (Suspect(Part.SERVO, Channel.MIDDLE),)


def once_lost(_side, _fault):
    left = [1]

    def passed(data, _now):
        if data[0] == Opcode.SET_TOR and left:
            left.pop()
            return []
        return [(0.0, data)]

    return passed
