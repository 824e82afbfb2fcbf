"""One servo on the bus: registers, modes, protections, power."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_emulator.bench import Bench, BenchShaft
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.servo.memory import RegisterFile
from firmware_emulator.servo.model_file import EEPROM_END
from firmware_emulator.servo.models import REGISTERS
from firmware_emulator.servo.parameters import HLS3606M, ServoParameters

SHAFT_OF_SERVO_3 = 0
"""Servo 3 turns the index, whose counts fall as it closes; 3278 is open."""


class Bus:
    """A bare hand and what its servos answer."""

    def __init__(self, plant=None, **options):
        self.hand = EmulatedHand(plant or Bench(BenchShaft(friction=0.0)), start="bare", **options)
        self.answers = bytearray()
        self.port = self.hand.bus.connect(self.answers.extend)
        self.servo = self.hand.servos[3]

    def say(self, code, parameters=b"", *, servo=3):
        body = bytes((servo, len(parameters) + 2, code)) + parameters
        self.answers.clear()
        self.port.write(b"\xff\xff" + body + bytes((~sum(body) & 255,)))
        self.wait(0.02)
        return bytes(self.answers)

    def write(self, address, *data):
        assert self.say(3, bytes((address, *data)))[4] == self.servo.status

    def write_word(self, address, word):
        self.write(address, word & 255, word >> 8)

    def read(self, address, size=2):
        answer = self.say(2, bytes((address, size)))
        return int.from_bytes(answer[5:-1], "little")

    def position(self):
        word = self.read(56)
        return word if word < 0x8000 else 0x8000 - word

    def wait(self, seconds):
        self.hand.clock.sleep_until(self.hand.clock.now() + seconds)


@given(st.integers(0, 14), st.binary(min_size=1, max_size=40))
def test_a_locked_eeprom_forgets_at_power_up_and_an_open_one_does_not(address, data):
    """Whatever is written below the lock itself, which is at 55."""
    locked, opened = RegisterFile(1), RegisterFile(1)
    opened.write(REGISTERS["lock"].address, b"\0")
    for memory in (locked, opened):
        memory.write(address, data)
        memory.power_up()
    assert locked.read(0, EEPROM_END) == RegisterFile(1).read(0, EEPROM_END)
    written = RegisterFile(1)
    written.write(REGISTERS["lock"].address, b"\0")
    written.write(address, data)
    assert opened.read(0, EEPROM_END) == written.read(0, EEPROM_END)


def test_bytes_take_ten_microseconds_and_a_servo_a_hundred_to_answer():
    bus = Bus()
    arrived = []
    port = bus.hand.bus.connect(lambda data: arrived.append((bus.hand.clock.now(), len(data))))
    start = bus.hand.clock.now()
    port.write(bytes.fromhex("FF FF 03 02 01 F9"))
    port.write(bytes.fromhex("FF FF FE 06 82 38 0F 00 03 2F"))
    bus.wait(0.01)
    # Six bytes out and six back; ten out and twice twenty-one back, behind them.
    pings, reads = 0.00006 + 0.0001 + 0.00006, 0.0001 + 2 * (0.0001 + 0.00021)
    assert [(t - start, size) for t, size in arrived] == [
        (pytest.approx(pings), 6),
        (pytest.approx(0.00006 + reads), 42),
    ]


def test_a_goal_enables_the_torque_and_is_reached_after_the_dead_time():
    bus = Bus()
    bus.write(41, 0, *(3000).to_bytes(2, "little"), *(1023).to_bytes(2, "little"), *(32766).to_bytes(2, "little"))
    assert bus.read(40, 1) == 1
    assert bus.read(66, 1) == 0b11
    bus.wait(0.3)
    assert bus.position() == pytest.approx(3000, abs=1)
    assert bus.read(66, 1) == 0


def first_motion(bus, plant, limit_s=0.1):
    """Return after what time from now the shaft of servo 3 leaves its place, s."""
    written = bus.hand.clock.now()
    while bus.hand.clock.now() - written < limit_s:
        bus.wait(0.0002)
        bus.hand.advance_plant()
        if plant.angles()[SHAFT_OF_SERVO_3] != 0.0:
            return bus.hand.clock.now() - written
    return math.inf


def goal_on_the_wire(counts):
    """Return a write of the goal's block, registers 41 to 47: acceleration 0, no limits."""
    body = bytes((3, 10, 3, 41, 0)) + counts.to_bytes(2, "little") + (1023).to_bytes(2, "little") + bytes((0xFE, 0x7F))
    return b"\xff\xff" + body + bytes((~sum(body) & 255,))


def test_the_dead_time_is_the_recorded_hands():
    """15.3 ms from the host less 1 ms of wire (one hand, public logs of June-July 2026), on the loop's grid of 1 ms."""
    assert HLS3606M.goal_delay_s == pytest.approx(0.0143, abs=1e-6)
    plant = Bench(BenchShaft(friction=0.0))
    bus = Bus(plant)
    bus.port.write(goal_on_the_wire(2000))
    wire_s = 14 * 10e-6
    assert first_motion(bus, plant) - wire_s == pytest.approx(0.0143, abs=0.0025)


@pytest.mark.parametrize(("register", "step", "unit"), [(50, 1000, 100.0), (254, 1600, 100.0), (20, 300, 100.0)])
def test_a_unit_of_acceleration_is_a_hundred_counts_a_second_squared(register, step, unit):
    """HLS documentation, register 41: from rest to rest a triangle takes 2 sqrt(step / acceleration)."""
    bus = Bus(Bench(BenchShaft(friction=0.0)), servos=replace(HLS3606M, duty_per_count=0.018, stall_torque=5.0))
    bus.write(41, register, *(3278 - step).to_bytes(2, "little"), *(1023).to_bytes(2, "little"), 0xFE, 0x7F)
    took = 2.0 * math.sqrt(step / (unit * register))
    bus.wait(HLS3606M.goal_delay_s + took / 2 - 0.02)
    halfway = bus.position()
    bus.wait(took)
    assert 3278 - halfway == pytest.approx(step / 2, rel=0.12)
    assert 3278 - bus.position() == pytest.approx(step, abs=2)


def test_torque_off_cancels_a_goal_that_is_on_its_way():
    bus = Bus(servos=ServoParameters(goal_delay_s=0.2))
    bus.write_word(42, 2000)
    bus.write(40, 0)
    bus.wait(1.0)
    assert bus.position() == 3278


@pytest.mark.parametrize(("register", "word"), [(44, 0), (46, 0)])
def test_no_torque_and_no_speed_mean_no_motion(register, word):
    bus = Bus()
    bus.write_word(register, word)
    bus.write_word(42, 2000)
    bus.wait(0.5)
    assert bus.position() == 3278


def test_speed_mode_turns_on_both_ways_at_the_speed():
    for word, expected in ((20, 1000), (0x8000 | 20, -1000)):
        bus = Bus()
        bus.write(33, 1)
        bus.write_word(46, word)
        bus.wait(0.5)
        before = bus.position()
        bus.wait(0.48)
        assert bus.position() - before == pytest.approx(0.5 * expected, abs=10)


@pytest.mark.parametrize(("word", "sign"), [(300, -1), (0x8000 | 300, 1)])
def test_positive_torque_pulls_toward_lower_counts(word, sign):
    bus = Bus()
    bus.write(33, 2)
    bus.write_word(44, word)
    bus.wait(0.2)
    assert math.copysign(1, bus.position() - 3278) == sign


def test_pwm_mode_drives_open_loop():
    bus = Bus()
    bus.write(33, 3)
    bus.write_word(44, 500)
    bus.wait(1.0)
    assert bus.read(58) & 0x8000
    speed = (bus.read(58) & 0x7FFF) * 50
    assert speed == pytest.approx(0.5 * HLS3606M.no_load_speed_counts, rel=0.05)
    assert bus.read(60) & 0x3FF == 500


def test_the_position_counts_turns_unless_the_phase_says_otherwise():
    bus = Bus()
    bus.write_word(42, 0x8000 | 5000)
    bus.wait(2.0)
    assert bus.position() == pytest.approx(-5000, abs=1)
    bus.write(18, 0)
    assert bus.position() == pytest.approx(-5000 % 4096, abs=1)


def test_calibration_to_the_middle_and_to_a_value():
    bus = Bus()
    for parameters, value in ((b"", 2048), (b"\x10\x00", 16), (b"\x10\x80", -16)):
        assert bus.say(0x0B, parameters) == bytes.fromhex("FF FF 03 02 00 FA")
        assert bus.position() == value
    assert bus.say(0x0B, b"\1") == b""


def test_turns_are_lost_by_reset_and_at_power_up_and_the_offset_by_an_open_lock_only():
    bus = Bus()
    bus.write(55, 0)
    bus.say(0x0B, b"\x00\x50")
    assert bus.position() == 0x5000
    bus.say(0x0A)
    assert bus.position() == 0x5000 % 4096
    bus.say(0x08)
    bus.wait(1.0)
    assert bus.position() == 0x5000 % 4096
    bus.write(55, 1)
    bus.say(0x0B)
    assert bus.position() == 2048
    bus.say(0x08)
    bus.wait(1.0)
    assert bus.position() == 0x5000 % 4096


def test_reboot_is_silent_and_deaf_for_a_while():
    bus = Bus()
    bus.write_word(46, 100)
    assert bus.say(0x08) == b""
    assert bus.say(1) == b""
    bus.wait(0.8)
    assert bus.say(1) == bytes.fromhex("FF FF 03 02 00 FA")
    assert bus.read(46) == 32766


def test_a_cut_out_servo_waits_until_it_has_cooled_and_then_goes_to_the_last_goal():
    """Maker's FAQ: it cuts out at 80 °C, takes no command until it has cooled, and then resumes."""
    bus = Bus()
    bus.write_word(42, 3000)
    bus.servo.heat_to(81.5)
    bus.wait(0.2)
    assert bus.say(1)[4] == bus.read(65, 1) == 0x04
    for celsius in (81.5, 79.0, 71.5):
        bus.servo.heat_to(celsius)
        for goal in (2000, 2100):
            bus.write_word(42, goal)
            assert bus.read(40, 1) == 0
            bus.wait(0.3)
            assert bus.read(40, 1) == 0
            assert bus.read(69) & 0x7FFF <= 8
    bus.servo.heat_to(69.0)
    bus.wait(1.0)
    assert bus.say(1)[4] == 0
    assert bus.read(40, 1) == 1
    assert bus.position() == pytest.approx(2100, abs=2)


@pytest.mark.parametrize(("writes", "after"), [([], 1), ([(40, 0)], 0), ([(40, 0), (40, 1)], 1), ([(40, 2)], 2)])
def test_a_cooled_servo_has_the_torque_last_asked_for(writes, after):
    bus = Bus()
    bus.write_word(42, 3000)
    bus.servo.heat_to(85.0)
    bus.wait(0.2)
    for write in writes:
        bus.write(*write)
        assert bus.read(40, 1) == 0
    bus.servo.heat_to(60.0)
    bus.wait(0.2)
    assert bus.read(40, 1) == after


def test_a_blocked_servo_that_is_commanded_all_the_time_does_not_flap():
    bus = Bus(Bench(BenchShaft(stop_low=-1.0, stop_high=0.0)), servos=ServoParameters(start_temperature_c=78.0))
    switched, before = 0, 1
    for goal in range(600):
        bus.say(3, bytes((42, goal % 2, 0, 1000 & 255, 1000 >> 8)))
        bus.wait(0.1)
        switched, before = switched + (bus.read(40, 1) != before), bus.read(40, 1)
    assert 1 <= switched <= 12


def test_a_supply_out_of_range_is_reported_but_does_not_cut_the_torque():
    bus = Bus(servos=ServoParameters(voltage=9.5))
    bus.write_word(42, 3000)
    bus.wait(0.5)
    assert bus.say(1)[4] == 0x01
    assert bus.read(40, 1) == 1


def test_over_current_cuts_the_torque_after_its_time():
    blocked = Bench(BenchShaft(friction=0.0, stop_low=0.0, stop_high=0.0))
    bus = Bus(blocked)
    bus.write_word(28, 300)
    bus.write(33, 3)
    bus.write_word(44, 600)
    bus.wait(1.5)
    assert bus.say(1)[4] == 0
    bus.wait(0.8)
    assert bus.say(1)[4] == 0x08
    assert bus.read(40, 1) == 0
    bus.write(40, 1)
    bus.wait(0.5)
    assert bus.say(1)[4] == 0


@pytest.mark.parametrize("limit", [100, 700, 1023])
def test_a_blocked_servo_reads_its_goal_torque_and_pushes_no_harder(limit):
    blocked = Bench(BenchShaft(friction=0.0, stop_low=-1.0, stop_high=0.0, stop_stiffness=20.0))
    bus = Bus(blocked)
    bus.write_word(44, limit)
    bus.write_word(42, 0)
    bus.wait(1.0)
    readings = {bus.read(69) for _ in range(10)}
    assert max(readings) == limit
    # The stop's deflection is what the shaft is pushed with.
    pushed = blocked.angles()[SHAFT_OF_SERVO_3] * 20.0
    units = HLS3606M.stall_torque * HLS3606M.duty_per_count
    counts = pushed / units
    recorded = np.interp(counts, [0, 10, 20, 30, 40, 52, 75, 116], [0, 300, 740, 1290, 1900, 2600, 3375, 6695])
    assert recorded / 6.5 == pytest.approx(limit, rel=0.1)


@pytest.mark.parametrize(("error", "milliamperes"), [(10, 31), (20, 37), (30, 43), (40, 47.5), (52, 50), (75, 45)])
def test_a_held_error_reads_the_recorded_current_through_the_bytes(error, milliamperes):
    """Public logs June-July 2026, TTdragoAlex/tetherIA-aero-hand-open 58b518e."""
    bus = Bus(Bench(BenchShaft(friction=0.0, stop_low=-1.0, stop_high=0.0, stop_stiffness=1e4)))
    bus.write_word(42, bus.position() - error)
    bus.wait(1.0)
    assert abs(bus.position() - bus.read(42)) == error
    read = sum(bus.read(69) for _ in range(50)) / 50
    assert 6.5 * read / error == pytest.approx(milliamperes, rel=0.04)


def test_holding_a_load_heats_and_rest_cools():
    bus = Bus(Bench(BenchShaft(stop_low=-1.0, stop_high=0.0)))
    start = bus.read(63, 1)
    bus.write_word(44, 400)
    bus.write_word(42, 0)
    bus.wait(100.0)
    hot = bus.read(63, 1)
    assert hot - start > 8
    bus.write(40, 0)
    bus.wait(300.0)
    assert bus.read(63, 1) < hot - 3


def test_angle_limits_bound_goals_only_when_told_so():
    for clamp, reached in ((False, -1000), (True, 0)):
        bus = Bus(servos=ServoParameters(clamp_goal=clamp))
        bus.write_word(42, 0x8000 | 1000)
        bus.wait(2.0)
        assert bus.position() == pytest.approx(reached, abs=1)


def test_a_goal_is_followed_in_the_frame_that_counts_have_now():
    bus = Bus()
    goal = (0, 184, 11, 255, 3, 254, 127)  # 3000 counts
    bus.write(41, *goal)
    bus.wait(1.0)
    assert bus.position() == pytest.approx(3000, abs=2)
    bus.say(0x0B)
    bus.wait(1.0)
    assert bus.position() == pytest.approx(3000, abs=2)
    bus.write_word(31, 100)
    bus.wait(1.0)
    assert bus.position() == pytest.approx(3000, abs=2)
    bus.write(41, *goal)
    bus.wait(1.0)
    assert bus.position() == pytest.approx(3000, abs=2)


@pytest.mark.parametrize("count", [253, 254, 255])
def test_a_read_that_does_not_fit_into_an_answer_is_not_answered(count):
    bus = Bus()
    answered = count <= 253
    assert len(bus.say(2, bytes((0, count)))) == (count + 6) * answered
    assert len(bus.say(0x82, bytes((0, count, 3)), servo=254)) == (count + 6) * answered
    assert bus.say(1) != b""


def test_a_second_action_applies_nothing():
    bus = Bus()
    bus.say(4, bytes((42, 0, 4)))  # REG WRITE of the goal position
    bus.say(5, servo=254)
    bus.write_word(42, 100)
    bus.say(5, servo=254)
    assert bus.read(42) == 100
