"""A run is entered once and left once: nothing of it stays, whatever ends it; a board has its own limits meanwhile."""

import logging
from dataclasses import replace

import pytest
from drawn import drawn

from aero.channels import Channel
from aero.protocol import Opcode
from hil.checks import EXPERIMENTS
from hil.emulated.any_hand import open_target
from hil.emulated.faults import parse_fault
from hil.recordings.mcap_file import read_recording
from hil.targets.delays import Loop
from hil.verdict.findings import failed
from hil.verdict.judge import Judge
from hil.verdict.run_end import FINISHED, EndKind
from hil.verdict.validation import validate
from model.units.conditions import Conditions


def on_board(target):
    board = target.truth.electronics.board
    return set(board.torque), set(board.speed)


@pytest.mark.parametrize(("firmware", "torque"), [("0.2.0", 700), ("0.1.1", 1023)])
def test_limits_that_another_program_has_left_are_replaced(firmware, torque):
    with open_target(firmware=firmware, conditions=Conditions(torque=300, speed=100)) as target:
        assert on_board(target) == ({300}, {100})
        result = validate(target, ["presence", "audit"])
        assert on_board(target) == ({torque}, {32766})
    assert result.passed


def test_limits_of_this_program_are_restored():
    with open_target() as target:
        target.hand.set_torque(Channel.RING, 400)
        target.hand.set_speed(Channel.INDEX, 900)
        asked = []
        validate(target, ["audit"], progress=lambda done, doing: asked.append(on_board(target)))
        assert set(map(str, asked)) == {str(({700}, {32766}))}
        board = target.truth.electronics.board
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
        target.truth.electronics.reset()
        target.clock.sleep_until(target.clock.now() + 1.0)
        target.hand.read_codes()
        assert target.hand.restarts == 1
        assert target.hand.settings_sent == {}


class OfTheTestError(Exception):
    """None that ends a run."""


def left_behind(target):
    """What a run must not leave: handlers and levels of loggers, listeners of the wire, limits on the board."""
    loggers = [logging.getLogger(name) for name in ("aero", "hil")]
    return [(logger.level, *logger.handlers) for logger in loggers], list(target.wire.listeners), on_board(target)


def fail(*_args, **_named):
    raise OfTheTestError


def break_off(where, monkeypatch):
    """Return the arguments of a run that raises in a callback, or lets judging raise."""
    if where in {"experiment", "link", "judged"}:
        monkeypatch.setattr(Judge, where, fail)
        return {}
    return {where: fail}


@pytest.mark.parametrize("where", drawn(["on_result", "progress", "experiment", "link", "judged"], 2))
def test_an_error_of_a_callback_or_of_judging_leaves_nothing_behind(where, monkeypatch, tmp_path):
    with open_target() as target:
        target.hand.set_torque(Channel.RING, 400)
        target.hand.command_codes([0] * 7)
        before = left_behind(target)
        with pytest.raises(OfTheTestError):
            validate(target, ["audit"], folder=tmp_path, **break_off(where, monkeypatch))
        target.hand.command_codes([0] * 7)
        assert left_behind(target)[:2] == before[:2]
        board = target.truth.electronics.board
        assert board.torque[5] == 400
    for name in ("audit", "session"):
        assert read_recording(tmp_path / f"{name}.mcap").header.experiment == name


def test_a_mistake_of_the_program_is_no_verdict(monkeypatch):
    """A bare ValueError while measuring is a defect, and says nothing about the hand."""

    def broken(recording):
        raise ValueError(recording)

    audit = EXPERIMENTS["audit"]
    monkeypatch.setitem(EXPERIMENTS, "audit", replace(audit, measure=broken))
    with open_target() as target, pytest.raises(ValueError, match="Recording"):
        validate(target, ["audit"])


@pytest.mark.parametrize("late_s", drawn([0.005, 0.02, 0.04], 1))
def test_a_late_computer_flags_no_healthy_hand(late_s):
    with open_target(unit="plausible:8100", conditions=Conditions(late_s=late_s)) as target:
        result = validate(target, ["presence", "audit", "response", "holding", "replay"])
    assert result.end.kind in {EndKind.FINISHED, EndKind.HOST_BUSY}
    assert failed(finding for finding in result.findings if finding != result.end.finding) == ()
    assert all(one.sentence for one in result.withheld)


@pytest.mark.parametrize(("by_s", "kind"), [(0.0, EndKind.FINISHED), (0.008, EndKind.HOST_BUSY)])
def test_a_run_of_which_no_time_can_be_judged_has_no_verdict(by_s, kind):
    """As found beside four spinning processes: a slow servo was within limits, for no reading of it was out of them."""
    with open_target() as target:
        for _ in range(200):
            target.delays.add(by_s, Loop.PROGRAM)
        result = validate(target, ["presence", "audit", "response"])
    assert result.end.kind is kind
    assert not result.withheld


def test_a_time_that_is_out_of_limits_is_not_judged_where_the_program_was_late_often():
    """8 ms each time."""
    found = {}
    for by_s in (0.0, 0.008):
        with open_target(faults=[parse_fault("slow_servo:ring=0.4")]) as target:
            for _ in range(200):
                target.delays.add(by_s, Loop.PROGRAM)
            result = validate(target, ["presence", "excursion", "response"])
        found[by_s] = (
            {(one.experiment, one.check) for one in failed(result.findings)},
            {(one.experiment, one.metric) for one in result.withheld},
        )
    time = ("response", "open_close_rate")
    assert time in found[0.0][0]
    assert not found[0.0][1]
    assert time in found[0.008][1]
    assert time not in found[0.008][0]
