"""A guarded hand on the emulated electronics: every reason to stop is provoked, and the hand is looked at after it."""

import dataclasses
import gc
import weakref
from contextlib import contextmanager

import numpy as np
import pytest
from guarded_hands import FailingLink, Tampered, close, guarded, torque_limits, wait

from aero import Channel
from aero.channels import WIRE_ORDER
from aero.driver import AeroHand
from aero.errors import LinkTimeoutError, RefusedError
from aero.firmware import firmware_of
from aero.protocol import MAX_CODE, Opcode
from aero.safety import GuardedHand, LinkLostError, SafetyReason, SafetyStopError, Thresholds
from aero.safety.stop import Violation
from firmware_emulator.bench import Bench
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import InProcessLink
from hil.cli.exits import ending
from hil.emulated.any_hand import open_target

LIMP = Thresholds().limp_torque
HOT = Violation(SafetyReason.TEMPERATURE, "it is hot", Channel.RING)


@contextmanager
def stops(reason, channel=None, match=""):
    """Demand that the hand is stopped for a reason and a channel, and that its message says so."""
    with pytest.raises(SafetyStopError, match=match) as stop:
        yield
    assert (stop.value.reason, stop.value.channel) == (reason, channel)


def assert_open_and_limp(target):
    """The hand is open, its servos are weak, and it takes no more commands."""
    electronics = target.truth.electronics
    electronics.clock.sleep_until(electronics.clock.now() + 0.5)
    electronics.advance_plant()
    assert np.abs(np.rad2deg(target.truth.plant.joint_angles())).max() < 15.0
    assert torque_limits(target) == [LIMP] * 7
    with pytest.raises(SafetyStopError, match="stopped"):
        target.hand.command_codes([0] * 7)


def wire_opcodes(target):
    return [record.data[0] for record in target.wire.since(0, 0.0) if record.direction == "to_hand"]


def test_nothing_is_sent_that_moves_before_currents_and_temperatures_were_read():
    with guarded() as target:
        close(target, Channel.INDEX)
        opcodes = wire_opcodes(target)
    first = opcodes.index(Opcode.CTRL_POS)
    assert {Opcode.GET_CURR, Opcode.GET_TEMP, Opcode.GET_POS, Opcode.SET_SPE, Opcode.SET_TOR} == set(opcodes[:first])


def test_a_hand_that_is_only_read_is_left_as_it_is():
    with guarded() as target:
        target.hand.read_codes()
        wait(target, 1.0)
        health = target.guard.check()
    assert {len(column) for column in dataclasses.astuple(health)} == {7}
    assert not {Opcode.CTRL_POS, Opcode.SET_SPE, Opcode.SET_TOR, Opcode.CTRL_TOR, Opcode.HOMING} & set(
        wire_opcodes(target)
    )


@pytest.mark.parametrize("firmware", ["pre", "0.1.0", "0.1.5", "0.2.0"])
def test_it_opens_gently_first_and_gets_its_usual_limits_back(firmware):
    usual = firmware_of(firmware).settings
    with guarded(firmware=firmware) as target:
        close(target, Channel.INDEX, share=0.5)
        wait(target, 1.0)
        assert target.hand.read_codes()[Channel.INDEX] == pytest.approx(0.5 * MAX_CODE, abs=2000)
        if usual is not None:
            thumb = Thresholds().stop_torque
            assert torque_limits(target) == [thumb] * 3 + [usual.torque] * 4
    assert (usual is None) == (firmware == "pre")


@pytest.mark.parametrize("what", ["set_speed", "set_torque"])
def test_a_limit_that_the_firmware_does_not_have_is_refused_at_once(what):
    """A board of firmware `pre` leaves the request unanswered, and for that second nothing would watch the hand."""
    with guarded(firmware="pre") as target:
        begun, opcodes = target.clock.now(), wire_opcodes(target)
        with pytest.raises(RefusedError, match="has no speed and torque limits"):
            getattr(target.hand, what)(Channel.INDEX, 500)
        assert target.clock.now() == begun
        assert wire_opcodes(target) == opcodes


def test_a_program_may_use_less_torque_until_it_expects_stops_again():
    with guarded() as target:
        usual, thumb = firmware_of("0.2.0").settings.torque, Thresholds().stop_torque
        for share, expected in ((0.4, [400] * 7), (0.6, [thumb] * 3 + [600] * 4)):
            target.guard.limit_torques(share)
            close(target, Channel.INDEX, share=0.5)
            wait(target, 0.1)
            assert torque_limits(target) == expected
        target.begin()
        close(target, Channel.INDEX, share=0.5)
        wait(target, 0.1)
        assert torque_limits(target) == [thumb] * 3 + [usual] * 4


def test_a_firmware_without_torque_settings_takes_no_limit():
    with guarded(firmware="pre") as target:
        target.guard.limit_torques(0.4)
        assert Opcode.SET_TOR not in wire_opcodes(target)


def test_a_closed_hand_is_opened_no_faster_than_the_gentle_speed():
    """An earlier program left it closed."""
    with guarded() as target:
        electronics, plant = target.truth.electronics, target.truth.plant
        electronics.receive(bytes([Opcode.CTRL_POS, 0]) + b"\xff\xc0" * 7)
        electronics.clock.sleep_until(electronics.clock.now() + 1.5)
        speeds = []
        advance = electronics.kernel.run_until

        def sampled(t):
            advance(t)
            speeds.append(np.abs(plant.speeds()).max())

        electronics.kernel.run_until = sampled
        close(target)
        assert target.hand.read_codes().max() < 0.1 * MAX_CODE
    gentle_rad_s = Thresholds().gentle_speed * 0.732 * 2 * np.pi / 60
    assert 0.5 * gentle_rad_s < max(speeds) < 1.5 * gentle_rad_s


def test_the_end_of_the_program_leaves_the_hand_open_and_limp():
    with guarded() as target:
        close(target, *Channel, share=0.7)
        wait(target, 1.0)
    assert_open_and_limp(target)


@pytest.mark.parametrize("error", [KeyboardInterrupt(), SystemExit(143), ZeroDivisionError()])
def test_ctrl_c_termination_and_crashes_leave_the_hand_open_and_limp(error):
    targets = []

    def program():
        with guarded() as target:
            targets.append(target)
            close(target, *Channel, share=0.7)
            wait(target, 1.0)
            raise error

    with pytest.raises(type(error)):
        program()
    assert_open_and_limp(targets[0])


def test_a_blocked_channel_is_stopped_for_its_current():
    """The palm blocks CMC flexion; the guard's own limit for it is lifted to let the current through."""
    with guarded(thresholds=Thresholds(stop_torque=700)) as target:
        close(target, Channel.THUMB_CMC_FLEXION)
        start = target.clock.now()
        with stops(
            SafetyReason.CURRENT,
            Channel.THUMB_CMC_FLEXION,
            r"thumb_cmc_flexion has drawn more than 4 A for 0.3 s, now 4\.\d A",
        ):
            wait(target, 3.0)
        assert_open_and_limp(target)
    opened = target.clock.now() - start
    assert opened < 0.3 + 0.3 + Thresholds().opening_s + 1.0


def test_the_palm_blocks_a_healthy_hand_without_a_stop():
    with guarded() as target:
        close(target, Channel.THUMB_CMC_FLEXION)
        wait(target, 3.0)


@pytest.mark.parametrize("share", [0.3, 0.97])
def test_every_channel_of_a_healthy_hand_closes_without_a_stop(share):
    with guarded() as target:
        for channel in Channel:
            close(target, channel, share=share)
            wait(target, 1.0)
            close(target)
            wait(target, 0.6)


def test_a_hot_hand_is_not_moved():
    with (
        guarded(servos={"start_temperature_c": 67.0}) as target,
        stops(SafetyReason.TEMPERATURE, Channel.INDEX, r"not moved.*66"),
    ):
        close(target, Channel.INDEX)
    assert Opcode.CTRL_POS not in wire_opcodes(target)


def test_a_hand_that_holds_against_something_is_not_moved():
    with guarded(thresholds=Thresholds(stop_torque=700)) as target:
        electronics = target.truth.electronics
        electronics.receive(bytes([Opcode.CTRL_POS, 0, 0, 0, 0xFF, 0xFF]) + bytes(10))
        electronics.clock.sleep_until(electronics.clock.now() + 1.0)
        with stops(
            SafetyReason.CURRENT_AT_REST,
            Channel.THUMB_CMC_FLEXION,
            r"not moved. thumb_cmc_flexion draws 4\.\d A at rest",
        ):
            close(target, Channel.INDEX)


def test_a_hand_that_heats_up_is_stopped():
    heating = {"start_temperature_c": 60.0, "rest_temperature_c": 80.0, "cooling_s": 20.0}
    with guarded(servos=heating) as target:
        close(target, Channel.INDEX, share=0.5)
        with pytest.raises(SafetyStopError, match=r"is at 6[56] °C \(limit 65 °C\)"):
            wait(target, 10.0)
        assert_open_and_limp(target)


def test_a_servo_that_falls_off_the_bus_stops_the_hand():
    """The board goes on answering from its cache."""
    with guarded() as target:
        close(target, Channel.INDEX, share=0.5)
        wait(target, 1.0)
        servos = target.truth.electronics.bus.servos
        servos.pop()
        with stops(SafetyReason.STALE, None, r"repeated to the last digit.*SUPPLY OFF.*readings do not change"):
            wait(target, 1.0)
        assert torque_limits(target)[:6] == [LIMP] * 6


def test_a_board_that_goes_silent_stops_the_hand_and_is_opened_blindly():
    with guarded(link=FailingLink) as target:
        close(target, Channel.INDEX, share=0.5)
        wait(target, 1.0)
        target.wire._transport.silent = True
        with stops(SafetyReason.SILENT, None, "not answered"):
            wait(target, 2.0)
    electronics = target.truth.electronics
    electronics.clock.sleep_until(electronics.clock.now() + 0.5)
    electronics.advance_plant()
    assert np.abs(np.rad2deg(target.truth.plant.joint_angles())).max() < 15.0


def test_a_board_too_old_for_limits_names_the_request_that_it_did_not_answer():
    electronics = EmulatedHand(Bench(), firmware="pre")
    settings = firmware_of("0.2.0").settings
    hand = GuardedHand(InProcessLink(electronics), electronics.clock, spans_counts=[3278] * 7, usual=settings)
    with pytest.raises(SafetyStopError, match="too old for SET_SPE") as stop, hand:
        hand.begin()
    assert stop.value.reason is SafetyReason.NOT_OPENED


def test_a_hand_that_is_unplugged_is_reported_with_what_to_do():
    with guarded(link=FailingLink) as target:
        close(target, Channel.INDEX, share=0.5)
        target.wire._transport.unplugged = True
        said = r"stopped\. The link was lost\. SWITCH THE HAND'S SUPPLY OFF.*cannot write"
        with pytest.raises(LinkLostError, match=said) as lost:
            target.hand.close()
    assert lost.value.reason is SafetyReason.LINK_LOST
    assert ending(lost.value)[0] == 3


def test_a_hand_that_is_unplugged_while_it_is_stopped_was_stopped_by_the_guard():
    with guarded(link=FailingLink) as target:
        close(target, Channel.INDEX, share=0.5)

        def hot(_celsius):
            target.wire._transport.unplugged = True
            return HOT

        target.hand._guard.lookout.watch.temperatures = hot
        with pytest.raises(SafetyStopError, match=r"it is hot.*SUPPLY OFF") as stop:
            wait(target, 2.0)
    assert ending(stop.value)[0] == 4


def test_what_the_program_asked_in_vain_counts_as_silence():
    """Found by the search of test_promises.py: the board hung for 5 s before the hand was opened."""
    with guarded(link=FailingLink) as target:
        close(target, Channel.INDEX, share=0.5)
        wait(target, 1.0)
        link, clock = target.wire._transport, target.clock.bare
        link.silent, link.log, begin = True, [], clock.now()
        with pytest.raises(LinkTimeoutError):
            target.hand.read_speeds()
        with pytest.raises(SafetyStopError, match="not answered") as stop:
            target.hand.read_speeds()
    opening = next(t for t, direction, data in link.log if direction == ">" and data[0] == Opcode.CTRL_POS)
    assert opening - begin < 2.2
    assert "busy" not in str(stop.value)


def test_a_board_that_hangs_is_not_blamed_on_an_idle_machine():
    with guarded() as target:
        close(target, Channel.INDEX, share=0.5)
        wait(target, 1.0)
        target.truth.electronics.board.stop()
        with pytest.raises(SafetyStopError, match="has not answered") as stop:
            wait(target, 5.0)
    for word in ("busy", " late", "came up to"):
        assert word not in str(stop.value).split("SWITCH")[0]


def test_a_channel_that_does_not_open_is_not_given_its_usual_torque():
    def stays(drive):
        return dataclasses.replace(drive, setpoint=2.0)

    with guarded(rewire=lambda plant: Tampered(plant, Channel.INDEX, stays)) as target:
        electronics = target.truth.electronics
        electronics.receive(bytes([Opcode.CTRL_POS, 0]) + bytes(14))
        electronics.clock.sleep_until(electronics.clock.now() + 1.0)
        with stops(SafetyReason.STILL_CLOSED, Channel.INDEX, r"index is still \d+% closed after"):
            close(target, Channel.MIDDLE)
        assert max(torque_limits(target)) <= Thresholds().gentle_torque


def test_a_stopped_hand_says_why_at_every_later_call():
    with guarded(servos={"start_temperature_c": 60.0, "rest_temperature_c": 80.0, "cooling_s": 20.0}) as target:
        close(target, Channel.INDEX, share=0.5)
        for _ in range(3):
            with pytest.raises(SafetyStopError, match="65"):
                wait(target, 10.0)
        for call in (target.hand.read_codes, target.hand.home, lambda: target.hand.command_torques([0] * 7)):
            with pytest.raises(SafetyStopError, match="65"):
                call()


def test_a_stopped_hand_is_freed_when_it_is_closed():
    """Else a process that opens many would keep each that was stopped, with all bytes of its link."""

    def stopped():
        with guarded(servos={"start_temperature_c": 60.0, "rest_temperature_c": 80.0, "cooling_s": 20.0}) as target:
            close(target, Channel.INDEX, share=0.5)
            with pytest.raises(SafetyStopError, match="65"):
                wait(target, 10.0)
            return weakref.ref(target.hand)

    hand = stopped()
    gc.collect()
    assert hand() is None


def test_homing_and_torque_mode_pass_a_healthy_hand():
    with guarded() as target:
        target.hand.home()
        close(target, Channel.INDEX, share=0.5)
        wait(target, 1.0)
        target.hand.command_torques([100] * 7)
        wait(target, 1.0)
        close(target)
        wait(target, 1.0)


def test_the_guard_sees_every_peak_of_the_length_that_matters():
    """Currents are looked at often enough whatever the program does in between (owners sampled 74 times a run)."""
    with guarded() as target:
        close(target, Channel.INDEX, share=0.5)
        mark, start = target.wire.mark(), target.clock.now()
        wait(target, 5.0)
        looks = [
            record.t
            for record in target.wire.since(mark, start)
            if record.direction == "to_hand" and record.data[0] == Opcode.GET_CURR
        ]
    assert np.diff(looks).max() < Thresholds().current_s / 4


@pytest.mark.parametrize(("name", "asked", "expected"), [("emulated", None, False), ("emulated", True, True)])
def test_hands_in_software_are_guarded_on_request_only(name, asked, expected):
    with open_target(name, guarded=asked) as target:
        assert (target.guard is not None) == expected
        assert not target.real_time


def test_another_program_that_moves_the_hand_stops_it():
    with guarded() as target:
        close(target, Channel.INDEX, share=0.4)
        wait(target, 3.0)
        target.truth.electronics.receive(bytes([Opcode.CTRL_POS, 0]) + bytes(14))
        with stops(SafetyReason.MOTION_AT_REST, Channel.INDEX, r"index moved by -\d+% of its window without a command"):
            wait(target, 1.0)
        assert_open_and_limp(target)


def test_the_first_goal_is_approached_as_slowly_as_the_hand_opens():
    with guarded() as target:
        mark, start = target.wire.mark(), target.clock.now()
        close(target, Channel.INDEX, share=0.9)
        sent = [r for r in target.wire.since(mark, start) if r.direction == "to_hand" and r.data[0] == Opcode.CTRL_POS]
    index = 2 + 2 * WIRE_ORDER.index(Channel.INDEX)
    codes = np.array([int.from_bytes(record.data[index : index + 2], "little") for record in sent])
    assert codes[-1] == round(0.9 * MAX_CODE)
    assert np.diff(codes).max() <= 1.02 * MAX_CODE * 0.02 / Thresholds().opening_s


CALLS = {
    "command_codes": ([0] * 7,),
    "command_codes_blindly": ([0] * 7,),
    "command_torques": ([0] * 7,),
    "read_codes": (),
    "read_currents": (),
    "read_temperatures": (),
    "read_speeds": (),
    "set_speed": (Channel.INDEX, 1000),
    "set_torque": (Channel.INDEX, 300),
    "knows": (Opcode.SET_TOR,),
    "trim": (Channel.INDEX, 0),
    "calibrate_mid": (Channel.INDEX,),
    "home": (),
    "set_id": (1, 500),
    "resynchronise": (),
}
"""Every exchange of a driver, with arguments that it takes."""
NOT_FOR_PROGRAMS = {"open_unguarded", "disturbances", "silent_from"}
"""What a guarded hand does not offer: a way past the guard, and what only the guard asks for."""


def test_a_guarded_hand_offers_every_exchange_and_refuses_each_after_a_stop():
    bare = {name for name in vars(AeroHand) if not name.startswith("_")}
    assert bare - set(dir(GuardedHand)) == NOT_FOR_PROGRAMS
    exchanges = {name for name in bare if callable(getattr(AeroHand, name))} - {"open_unguarded", "close"}
    assert exchanges == CALLS.keys()
    with guarded() as target:
        close(target, Channel.INDEX, share=0.5)
        target.hand._guard.lookout.watch.temperatures = lambda _celsius: HOT
        with stops(SafetyReason.TEMPERATURE, Channel.RING, "it is hot"):
            wait(target, 2.0)
        mark = target.wire.mark()
        for name, arguments in CALLS.items():
            with stops(SafetyReason.TEMPERATURE, Channel.RING, "it is hot"):
                getattr(target.hand, name)(*arguments)
        assert target.wire.mark() == mark
