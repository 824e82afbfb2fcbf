"""Kinds of servo as data: what each answers, what it lacks, and a new one from a file."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_emulator.bench import Bench, BenchShaft
from firmware_emulator.bus import ServoBus
from firmware_emulator.kernel import Kernel
from firmware_emulator.packets import pack
from firmware_emulator.servo.frame import Mounting
from firmware_emulator.servo.memory import RegisterFile
from firmware_emulator.servo.model_file import MEMORY_SIZE
from firmware_emulator.servo.models import SHIPPED, model_of
from firmware_emulator.servo.parameters import RAD_PER_COUNT, ServoParameters
from firmware_emulator.servo.servo import Servo
from firmware_emulator.servo.shafts import Shafts

PING, READ, WRITE, CALIBRATE, SYNC_READ = 1, 2, 3, 0x0B, 0x82


class One:
    """One servo of a model on a bus, at 2048 counts of 4096 when its shaft is at zero."""

    def __init__(self, model, *, zero=2048.0, angle=0.0, direction=1, spring=0.0, **own):
        self.kernel = Kernel()
        parameters = ServoParameters.of_model(str(model), **own)
        self.bench = Bench(BenchShaft(friction=0.0, back_emf=parameters.back_emf, spring=spring), angles=(angle,) * 7)
        shafts = Shafts(self.kernel, self.bench, loop_period_s=0.001, refresh_period_s=0.002)
        self.servo = Servo(1, Mounting(0, direction, zero), parameters, self.kernel, shafts, seed=0)
        self.answers = bytearray()
        self.port = ServoBus(self.kernel, [self.servo], 1e-4).connect(self.answers.extend)
        self.port.baud = self.servo.baud
        self.order = self.servo.model.byte_order

    def ask(self, code, parameters=b"", *, servo=1):
        self.answers.clear()
        self.port.write(pack(servo, code, bytes(parameters)))
        self.wait(0.02)
        return bytes(self.answers)

    def wait(self, seconds):
        self.kernel.run_until(self.kernel.now + seconds)

    def read(self, address, size=2):
        answer = self.ask(READ, (address, size))
        return int.from_bytes(answer[5:-1], self.order)

    def write(self, address, value, size=2):
        assert self.ask(WRITE, bytes((address,)) + value.to_bytes(size, self.order)) == pack(1, self.servo.status)


@pytest.mark.parametrize(
    ("model", "number", "order"),
    [
        ("HLS3606M", 2570, "little"),
        ("STS3215", 777, "little"),
        ("SM8512BL", 11272, "little"),
        ("SCS0009", 1284, "big"),
    ],
)
def test_a_servo_has_its_model_number_in_its_own_byte_order(model, number, order):
    """LeRobot 0.6.1, motors/feetech/tables.py; 2570 is the hand's."""
    assert One(model).ask(READ, (3, 2))[5:7] == number.to_bytes(2, order)


@given(st.sampled_from(SHIPPED), st.integers(0, 127), st.binary(min_size=1, max_size=40))
def test_any_write_leaves_every_register_of_every_model_in_its_range(name, address, data):
    model = model_of(name)
    memory = RegisterFile(1, model)
    constants = memory.bytes[MEMORY_SIZE:]
    memory.write(address, data)
    for register in model.registers.values():
        assert register.low <= abs(memory.get(register.name)) <= register.high or not register.writable
    assert memory.bytes[MEMORY_SIZE:] == constants


@given(st.sampled_from(SHIPPED), st.data())
def test_what_a_register_is_set_to_is_what_its_bytes_mean(name, data):
    model = model_of(name)
    register = data.draw(st.sampled_from(list(model.registers.values())))
    value = data.draw(st.integers(register.low, register.high))
    value *= data.draw(st.sampled_from([1, -1])) if register.sign_bit else 1
    memory = RegisterFile(1, model)
    memory.set(register.name, value)
    assert memory.get(register.name) == value
    word = abs(value) | ((value < 0) << register.sign_bit if register.sign_bit else 0)
    assert memory.read(register.address, register.size) == word.to_bytes(register.size, model.byte_order)


def test_an_scs_servo_answers_what_it_lacks_as_zeros_and_knows_no_sync_read():
    """No register for a current, an offset or a mode; LeRobot 0.6.1: no sync read with this protocol."""
    one = One("SCS0009", zero=512.0)
    assert one.read(69) == one.read(31) == one.read(33, 1) == 0
    one.write(33, 3, 1)
    one.write(42, 700)
    one.wait(1.0)
    assert one.read(33, 1) == one.read(69) == 0
    assert one.ask(SYNC_READ, (56, 2, 1), servo=0xFE) == b""
    assert one.ask(CALIBRATE) == b""
    assert one.ask(PING) == pack(1, 0)


def test_an_scs_servo_turns_300_degrees_in_1024_counts_and_reads_no_further():
    one = One("SCS0009", zero=512.0)
    one.write(42, 700)
    one.wait(1.0)
    # A gain of 15 and no damping; half a count is what it settles within.
    assert one.read(56) == pytest.approx(700, abs=1)
    assert one.bench.angles()[0] == pytest.approx((700 - 512) * 300.0 / 1024.0 * 3.14159265 / 180.0, abs=0.01)
    assert One("SCS0009", zero=512.0, angle=3.0).read(56) == 1023
    assert One("SCS0009", zero=512.0, angle=-3.0).read(56) == 0


def test_an_scs_servo_without_angle_limits_is_a_motor():
    """Transcribed SCSCL table: both limits 0 select the motor; bit 10 of 44 is the direction (SCSCL.cpp)."""
    one = One("SCS0009", zero=512.0)
    for address in (9, 11):
        one.write(address, 0)
    one.write(44, 500)
    one.wait(0.3)
    one.read(56)
    fast = one.bench.speeds()[0]
    one.write(44, 500 | 1 << 10)
    one.wait(0.6)
    one.read(56)
    assert one.bench.speeds()[0] == pytest.approx(-fast, rel=0.05)
    assert abs(fast) > 1.0


def test_an_sts_servo_goes_at_the_speed_it_is_told_and_at_zero_as_fast_as_it_can():
    """WritePosEx of the maker's SDK: acceleration, position, two zeros, speed."""
    for speed, expected in ((500, 500.0), (0, 3072.0)):
        one = One("STS3215")
        block = bytes((41, 0)) + (4000).to_bytes(2, "little") + bytes(2) + speed.to_bytes(2, "little")
        assert one.ask(WRITE, block) == pack(1, 0)
        one.wait(0.3)
        assert one.read(58) == pytest.approx(expected, rel=0.1)


def test_the_error_of_an_sts_servo_under_a_load_is_the_measured_one():
    """TheRobotStudio/SO-ARM100 issue 134: 20 to 30 counts under 1.5 kg on a lever of 10 cm at 45 degrees, P 32."""
    one = One("STS3215", spring=1.5 * 9.81 * 0.1 * math.sqrt(0.5))
    one.write(42, 2500)
    one.wait(3.0)
    assert 20 <= abs(2500 - one.read(56)) <= 30


def test_an_sts_servo_reads_0_to_4095_and_goes_where_it_reads_whatever_turned_it_before():
    """With bit 4 of the phase clear it counts no turns: a goal is within the turn in which the torque came on."""
    one = One("STS3215", zero=4000.0, angle=200 * RAD_PER_COUNT)
    assert one.read(56) == 104
    one.write(31, 1 << 11 | 1943)
    one.wait(0.1)
    assert one.read(56) == 2047
    one.write(42, 2047)
    one.wait(2.0)
    assert one.read(56) == pytest.approx(2047, abs=1)
    assert one.bench.angles()[0] == pytest.approx(200 * RAD_PER_COUNT, abs=2 * RAD_PER_COUNT)


@pytest.mark.parametrize("speed", [3000, 3000 | 1 << 15])
def test_a_wheel_that_is_put_into_position_mode_does_not_unwind_its_turns(speed):
    """Its torque stays on meanwhile; it turns to the goal by less than a turn."""
    one = One("STS3215")
    one.write(40, 1)
    one.write(33, 1)
    one.write(46, speed)
    one.wait(6.0)
    before = one.bench.angles()[0]
    assert abs(before) > 4 * math.tau
    one.write(46, 0)
    one.wait(0.5)
    one.write(33, 0)
    one.write(46, 3000)
    one.write(42, 2048)
    one.wait(8.0)
    assert one.read(56) == pytest.approx(2048, abs=2)
    assert abs(one.bench.angles()[0] - before) < 1.5 * math.tau


def test_an_sms_servo_begins_at_115200():
    one = One("SM8512BL")
    assert one.port.baud == 115_200
    assert one.ask(PING) == pack(1, 0)
    assert one.ask(CALIBRATE) == b""
