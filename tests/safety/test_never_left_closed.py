"""Endings times states times faults: a hand whose board answers is never left closed, and about another one it is said.

Open means what the mechanics say, not what the board reports.
"""

import itertools

import numpy as np
import pytest
from guarded_hands import FailingLink, close, guarded, torque_limits, wait

from aero import Channel
from aero.protocol import Opcode
from aero.safety import SafetyStopError, Thresholds

LIMP = Thresholds().limp_torque
OPEN_DEG = 25.0
"""No joint of an open hand is bent further: a thumb joint rests at 19 degrees in the windows of firmware 0.1.0."""
FIRMWARES = ["pre", "0.1.0", "0.1.5", "0.2.0"]


def fist(target):
    close(target, *list(Channel)[:4], share=0.9)
    wait(target, 1.0)


def stalled_thumb(target):
    close(target, Channel.THUMB_CMC_FLEXION)
    wait(target, 1.0)


def torque_mode(target):
    target.hand.command_torques([150] * 4 + [0] * 3)
    wait(target, 1.0)


STATES = [fist, stalled_thumb, torque_mode]


def nothing(electronics):
    pass


def restart(electronics):
    electronics.reset("reset")


def power_cycle(electronics):
    electronics.reset("power_on")


def out_of_step(electronics):
    electronics.receive(b"\x7f" * 7)


def servos_in_torque_mode(electronics):
    """As a restart in the middle of a change of mode leaves them: the board believes them in position mode."""
    for servo in electronics.servos:
        servo.memory.set("mode", 2)


ANSWERING = [nothing, restart, power_cycle, out_of_step, servos_in_torque_mode]


def openness_deg(target):
    electronics = target.truth.electronics
    electronics.clock.sleep_until(electronics.clock.now() + 0.5)
    electronics.advance_plant()
    return np.abs(np.rad2deg(target.truth.plant.joint_angles())).max()


UNKNOWN_TO_PRE = {stalled_thumb, torque_mode, servos_in_torque_mode}
"""Firmware `pre` has no torque limit, so that a stalled thumb is stopped at once (below), and no torque mode."""
CASES = [
    case
    for case in itertools.product(FIRMWARES, STATES, ANSWERING)
    if case[0] != "pre" or UNKNOWN_TO_PRE.isdisjoint(case)
]
QUICK = {("0.2.0", fist)}
"""The rest of the matrix takes minutes."""


@pytest.mark.parametrize(
    ("firmware", "state", "fault"),
    [case if case[:2] in QUICK else pytest.param(*case, marks=pytest.mark.slow) for case in CASES],
)
def test_a_hand_whose_board_answers_is_left_open_and_weak(firmware, state, fault):
    with guarded(firmware=firmware) as target:
        state(target)
        fault(target.truth.electronics)
    assert openness_deg(target) < OPEN_DEG
    if firmware != "pre":
        assert torque_limits(target) == [LIMP] * 7


@pytest.mark.parametrize("firmware", ["0.1.0", "0.2.0"])
@pytest.mark.parametrize("fault", [restart, power_cycle])
def test_a_fault_in_the_middle_of_the_last_opening_does_not_end_it(firmware, fault):
    with guarded(firmware=firmware) as target:
        fist(target)
        electronics = target.truth.electronics
        electronics.kernel.call_at(electronics.kernel.now + 1.0, fault, electronics)
    assert openness_deg(target) < OPEN_DEG
    if firmware != "pre":
        assert torque_limits(target) == [LIMP] * 7


class ForgetfulLink(FailingLink):
    """Loses the first five position commands after each limit; nothing says that a command has come."""

    left = 0

    def write(self, data):
        if data[0] == Opcode.SET_TOR:
            self.left = 5
        if data[0] == Opcode.CTRL_POS and self.left:
            self.left -= 1
        else:
            super().write(data)


def test_limits_are_in_force_though_commands_get_lost():
    """They count from the next position command on; of a hand that is open already there once was but one."""
    with guarded(link=ForgetfulLink) as target:
        fist(target)
    assert openness_deg(target) < OPEN_DEG
    assert torque_limits(target) == [LIMP] * 7


@pytest.mark.parametrize("firmware", FIRMWARES[1:])  # on `pre` the guard stops the thumb on its way to this posture
def test_a_hand_that_is_homed_while_it_is_closed_finds_its_true_zeros(firmware):
    """A thumb that lies against closed fingers would find its stop there, 49 degrees from the true one."""
    with guarded(firmware=firmware) as target:
        target.hand.command_codes([6706, 60211, 1370, 37790, 33086, 52414, 55688])
        wait(target, 1.5)
        target.hand.command_codes([35583, 64403, 2785, 5186, 26113, 59073, 31007])
        target.hand.home()
    assert openness_deg(target) < OPEN_DEG


@pytest.mark.parametrize("fault", [nothing, pytest.param(restart, marks=pytest.mark.slow), power_cycle, out_of_step])
def test_a_thumb_that_stalls_on_firmware_without_limits_is_stopped_and_opened(fault):
    """With a fault in the middle of the opening, which takes the last 2 of 3.2 s."""

    def stall(target):
        electronics = target.truth.electronics
        electronics.kernel.call_at(electronics.kernel.now + 2.0, fault, electronics)
        stalled_thumb(target)

    target, said = ended(guarded(firmware="pre"), stall)
    assert "4 A" in said
    assert openness_deg(target) < OPEN_DEG


class DeafLink(FailingLink):
    """A board that hangs: nothing is heard and nothing is said."""

    deaf = False

    def write(self, data):
        if not self.deaf:
            super().write(data)

    def read(self, size, timeout):
        data = super().read(size, timeout)
        return b"" if self.deaf else data


def ended(target_of, ending):
    """Return the target and what the guard said at its end."""
    with pytest.raises(SafetyStopError) as stop, target_of as target:
        ending(target)
    return target, str(stop.value)


@pytest.mark.parametrize("state", STATES)
def test_about_a_board_that_hangs_it_is_said_what_to_do(state):
    def hang(target):
        state(target)
        target.wire._transport.deaf = True

    _, said = ended(guarded(link=DeafLink), hang)
    assert "SWITCH THE HAND'S SUPPLY OFF" in said
    assert "does not answer" in said


def test_a_board_that_may_be_out_of_step_is_sent_no_byte_that_it_could_take_for_an_opcode():
    """Of the ramp that needs no answer: shifted, its positions would make a board home, or shift its zeros."""

    def fall_silent(target):
        fist(target)
        link = target.wire._transport
        link.silent, link.log = True, []

    target, said = ended(guarded(link=FailingLink), fall_silent)
    assert "does not answer" in said
    ramp = [
        data for _, direction, data in target.wire._transport.log if direction == ">" and data[0] == Opcode.CTRL_POS
    ]
    assert len(ramp) > 80
    assert {*Opcode}.isdisjoint(b"".join(data[2:] for data in ramp))


def test_a_board_that_hangs_for_a_while_is_waited_for():
    with guarded(link=DeafLink) as target:
        fist(target)
        link, kernel = target.wire._transport, target.truth.electronics.kernel
        link.deaf = True
        kernel.call_at(kernel.now + 6.0, setattr, link, "deaf", False)
    assert openness_deg(target) < OPEN_DEG
    assert torque_limits(target) == [LIMP] * 7


def test_a_servo_that_is_silent_is_said_and_the_others_open():
    def lose_pinky(target):
        fist(target)
        target.truth.electronics.bus.servos.pop()

    target, said = ended(guarded(), lose_pinky)
    assert "SWITCH THE HAND'S SUPPLY OFF" in said
    assert "readings do not change" in said
    assert torque_limits(target)[:6] == [LIMP] * 6


def test_a_restart_does_not_lose_the_limits():
    with guarded(firmware="0.2.0") as target:
        target.guard.limit_torques(0.4)
        close(target, Channel.INDEX, share=0.5)
        wait(target, 0.5)
        target.truth.electronics.reset("reset")
        wait(target, 1.0)
        close(target, Channel.MIDDLE, share=0.5)
        wait(target, 0.5)
        assert torque_limits(target) == [400] * 7


CALLS = {
    "read_currents": lambda hand: hand.read_currents(),
    "read_temperatures": lambda hand: hand.read_temperatures(),
    "read_speeds": lambda hand: hand.read_speeds(),
    "set_torque": lambda hand: hand.set_torque(Channel.INDEX, 700),
    "set_speed": lambda hand: hand.set_speed(Channel.INDEX, 32766),
    "trim": lambda hand: hand.trim(Channel.INDEX, 0),
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_every_call_looks(call):
    """A thumb blocked by the palm, its limit lifted; the program polls on its own clock."""
    with guarded(thresholds=Thresholds(stop_torque=700)) as target:
        close(target, Channel.THUMB_CMC_FLEXION)
        clock = target.clock.bare
        start = clock.now()

        def poll():
            while clock.now() < start + 5.0:
                clock.sleep_until(clock.now() + 0.02)
                call(target.hand)

        with pytest.raises(SafetyStopError, match="thumb_cmc_flexion has drawn more than 4 A"):
            poll()
        for later in [*CALLS.values(), lambda hand: hand.resynchronise(), lambda hand: hand.set_id(3, 500)]:
            with pytest.raises(SafetyStopError, match="4 A"):
                later(target.hand)
    assert openness_deg(target) < OPEN_DEG


def test_a_closed_hand_that_nobody_looked_at_is_opened():
    """As after a suspended machine wakes up; an open one is none the worse for it."""
    with guarded() as target:
        clock = target.clock.bare
        close(target)
        clock.sleep_until(clock.now() + 60.0)
        close(target, Channel.INDEX, share=0.5)
        clock.sleep_until(clock.now() + 60.0)
        with pytest.raises(SafetyStopError, match=r"nobody has polled the hand for 60 s.*suspended"):
            target.hand.read_codes()
    assert openness_deg(target) < OPEN_DEG


def test_limits_set_by_the_program_before_the_first_motion_count():
    with guarded() as target:
        target.hand.set_torque(Channel.INDEX, 300)
        close(target, Channel.INDEX, share=0.5)
        wait(target, 0.1)
        assert torque_limits(target)[3] == 300
