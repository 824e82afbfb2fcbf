"""A hand is judged under its firmware's own limits, whatever another program has left."""

import pytest

from aero.channels import Channel
from aero.protocol import Opcode
from hil import GroundTruth, open_target
from hil.faults import parse_fault
from hil.verdict.findings import failed
from hil.verdict.run_end import FINISHED
from hil.verdict.validation import validate
from model.units.conditions import Conditions


def on_board(target):
    board = target.get(GroundTruth).electronics.board
    return set(board.torque), set(board.speed)


@pytest.mark.parametrize(("firmware", "torque"), [("0.2.0", 700), ("0.1.1", 1023)])
def test_limits_that_another_program_has_left_are_replaced(firmware, torque):
    with open_target(firmware=firmware, conditions=Conditions(torque=300, speed=100)) as target:
        assert on_board(target) == ({300}, {100})
        result = validate(target, ["presence", "audit"])
        assert on_board(target) == ({torque}, {32766})
    assert result.passed


def test_limits_of_this_program_are_given_back():
    with open_target() as target:
        target.hand.set_torque(Channel.RING, 400)
        target.hand.set_speed(Channel.INDEX, 900)
        asked = []
        validate(target, ["audit"], progress=lambda done, doing: asked.append(on_board(target)))
        assert set(map(str, asked)) == {str(({700}, {32766}))}
        board = target.get(GroundTruth).electronics.board
        # Servo 5 is the ring's, 3 the index's.
        assert (board.torque[5], board.speed[3]) == (400, 900)
        assert sorted(board.torque)[1:] == [700] * 6
        assert target.hand.settings_sent[Opcode.SET_TOR, Channel.RING] == 400


def test_a_hand_that_nothing_moves_keeps_the_limits_that_it_has():
    with open_target(conditions=Conditions(torque=300)) as target:
        validate(target, ["presence"])
        assert on_board(target)[0] == {300}


def test_firmware_without_limits_is_asked_for_none():
    with open_target(firmware="pre", conditions=Conditions(torque=300)) as target:
        assert validate(target, ["presence", "audit"]).passed
        assert {record.data[0] for record in target.wire.since(0, 0.0)}.isdisjoint({Opcode.SET_TOR, Opcode.SET_SPE})


def test_a_board_with_older_firmware_than_was_said_is_measured_all_the_same():
    """Firmware `pre` leaves SET_SPE unanswered."""
    with open_target(faults=[parse_fault("board_runs_pre")]) as target:
        result = validate(target, ["presence", "audit", "response"])
    assert result.end is FINISHED
    assert "command_to_motion" in {finding.check for finding in failed(result.findings)}


def test_a_restart_of_the_board_forgets_what_was_set():
    with open_target() as target:
        target.hand.set_torque(Channel.RING, 400)
        target.get(GroundTruth).electronics.reset()
        target.clock.sleep_until(target.clock.now() + 1.0)
        target.hand.read_codes()
        assert target.hand.restarts == 1
        assert target.hand.settings_sent == {}
