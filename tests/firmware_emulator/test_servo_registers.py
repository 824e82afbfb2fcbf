"""Registers with an effect: gain, dead zone, angle limits and overload, each as its maker's table says."""

from dataclasses import replace

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from firmware_emulator.bench import Bench, BenchShaft
from firmware_emulator.kernel import Kernel
from firmware_emulator.servo.frame import Mounting
from firmware_emulator.servo.parameters import HLS3606M, RAD_PER_COUNT
from firmware_emulator.servo.servo import Servo
from firmware_emulator.servo.shafts import Shafts
from tests.firmware_emulator.test_servo import Bus

OPEN = 3278
LOAD_N_M = 0.05
STS = replace(HLS3606M, model="STS3215")
OVERLOAD = 0x20


def loaded():
    """A shaft that a constant load pulls, without friction."""
    return Bus(plant=Bench(BenchShaft(friction=0.0, spring=LOAD_N_M)))


def error_under_load(bus):
    bus.write_word(42, OPEN)
    bus.wait(1.0)
    return abs(bus.position() - OPEN)


@pytest.mark.parametrize(("address", "gain"), [(50, 16), (50, 32), (50, 64)])
def test_the_gain_divides_the_error_under_a_load(address, gain):
    """Transcribed HLS table, register 50: position loop P coefficient, loaded from 21; in proportion (assumption)."""
    bus = loaded()
    bus.write(address, gain)
    expected = LOAD_N_M / (HLS3606M.stiffness * gain / 32) / RAD_PER_COUNT
    assert error_under_load(bus) == pytest.approx(expected, abs=1.0)


def test_the_gain_of_the_eeprom_counts_from_the_next_power_on():
    bus = loaded()
    bus.write(55, 0)
    bus.write(21, 64)
    assert bus.read(50, 1) == 32
    bus.servo.power_up()
    assert bus.read(50, 1) == 64
    half = LOAD_N_M / (HLS3606M.stiffness * 2) / RAD_PER_COUNT
    assert error_under_load(bus) == pytest.approx(half, abs=1.0)


@pytest.mark.parametrize("zone", [1, 4, 16])
def test_errors_in_the_dead_zone_are_left_alone(zone):
    """Transcribed HLS table, registers 26 and 27: dead zones of 0 to 16 counts; one count is the factory's."""
    bus = Bus(plant=Bench(BenchShaft(friction=0.0)))
    bus.write(26, zone, zone)
    bus.write_word(42, OPEN - zone)
    bus.wait(0.5)
    assert bus.position() == (OPEN - 1 if zone == 1 else OPEN)
    bus.write_word(42, OPEN - zone - 20)
    bus.wait(0.5)
    assert abs(bus.position() - (OPEN - zone - 20)) <= zone


def test_goals_stay_within_angle_limits_that_someone_has_set():
    """Transcribed HLS table, registers 9 and 11. The factory's 0 and 4095 bound nothing here, nor does 0 and 0."""
    bus = Bus(plant=Bench(BenchShaft(friction=0.0)))
    for low, high, goal, reached in (
        (0, 4095, 4500, 4500),
        (2500, 3500, 4501, 3500),
        (2500, 3500, 2000, 2500),
        (0, 0, 2001, 2001),
    ):
        bus.write_word(9, low)
        bus.write_word(11, high)
        bus.write_word(42, goal)
        bus.wait(1.0)
        assert bus.position() == pytest.approx(reached, abs=2)


def test_128_in_the_torque_register_makes_the_present_position_of_an_sts_servo_the_middle():
    """Transcribed tables: STS and SMS only; an HLS servo has the instruction CALIBRATE (0x0B) instead."""
    bus = Bus(servos=STS)
    bus.write(40, 0)
    bus.write(40, 128)
    bus.wait(0.1)
    assert bus.position() == 2048
    assert bus.read(40, 1) == 0
    bus.write(31, 0, 0)
    bus.wait(0.1)
    assert bus.position() == OPEN


def test_an_sts_servo_whose_torque_is_on_keeps_it_on_and_goes_to_its_goal_in_the_new_counts():
    """As after CALIBRATE: the goal register still holds the old counts."""
    bus = Bus(servos=STS)
    bus.write(40, 1)
    bus.wait(0.1)
    bus.write(40, 128)
    bus.wait(1.0)
    assert bus.read(40, 1) == 1
    assert bus.position() == pytest.approx(OPEN, abs=1)
    assert bus.servo.memory.get("offset") != 0


def test_128_in_the_torque_register_calibrates_no_hls_servo_and_nothing_elsewhere():
    bus = Bus()
    bus.write(40, 128)
    assert bus.position() == OPEN
    bus = Bus(servos=STS)
    bus.write(41, 128)
    bus.write(39, 128)
    assert bus.position() == OPEN


def blocked(servos, seconds, *, unload=0x2C):
    """A servo that pushes at full torque against a stop it cannot pass."""
    plant = Bench(BenchShaft(friction=0.0, stop_low=0.0, stop_high=0.0, stop_stiffness=2000.0))
    bus = Bus(plant=plant, servos=servos)
    bus.write(19, unload)
    bus.write_word(44, 1023)
    bus.write_word(42, OPEN - 1000)
    bus.wait(seconds)
    return bus, plant


def effort(plant):
    return abs(plant.efforts()[0])


def test_a_blocked_sts_servo_falls_back_to_its_holding_torque_after_two_seconds():
    """Transcribed STS table: above 80 % (36) for 200 x 10 ms (35), 20 % (34) is left; status bit 5."""
    bus, plant = blocked(replace(STS, full_duty_units=500.0), 1.5)
    assert bus.read(65, 1) == 0
    assert effort(plant) == pytest.approx(HLS3606M.stall_torque, rel=0.02)
    bus.wait(1.0)
    assert bus.read(65, 1) == OVERLOAD
    assert bus.read(40, 1) == 1
    assert effort(plant) == pytest.approx(0.2 * HLS3606M.stall_torque, rel=0.02)
    bus.wait(120.0)
    assert bus.read(65, 1) == OVERLOAD
    assert effort(plant) == pytest.approx(0.2 * HLS3606M.stall_torque, rel=0.02)
    # Another goal lets go of it (assumption).
    bus.write_word(42, OPEN - 900)
    bus.wait(0.3)
    assert bus.read(65, 1) == 0
    assert effort(plant) == pytest.approx(HLS3606M.stall_torque, rel=0.02)


@pytest.mark.parametrize(("holding", "hundredths", "threshold"), [(30, 50, 80), (20, 200, 50)])
def test_the_three_registers_of_overload_count(holding, hundredths, threshold):
    bus, plant = blocked(replace(STS, full_duty_units=500.0), 0.0)
    bus.write(34, holding, hundredths, threshold)
    bus.write_word(48, 10 * threshold - 10)
    bus.wait(5.0)
    assert bus.read(65, 1) == 0, "a load below the threshold is no overload"
    bus.write_word(48, 1000)
    bus.wait(0.01 * hundredths - 0.2)
    assert bus.read(65, 1) == 0
    bus.wait(0.5)
    assert bus.read(65, 1) == OVERLOAD
    assert effort(plant) == pytest.approx(holding / 100 * HLS3606M.stall_torque, rel=0.02)


def test_overload_that_is_not_among_the_unload_conditions_does_nothing():
    bus, plant = blocked(replace(STS, full_duty_units=500.0), 10.0, unload=0x0C)
    assert bus.read(65, 1) == 0
    assert effort(plant) == pytest.approx(HLS3606M.stall_torque, rel=0.02)


def test_a_blocked_hls_servo_is_not_overloaded_and_heats_up_until_its_temperature_ends_it():
    """The HLS table names the bit and no threshold; of its protections, temperature (13) is left: 80 degrees."""
    bus, plant = blocked(HLS3606M, 30.0)
    assert bus.read(65, 1) == 0
    assert effort(plant) == pytest.approx(HLS3606M.stall_torque, rel=0.02)
    assert bus.read(63, 1) > 45
    bus.servo.heat_to(81.5)
    bus.wait(0.3)
    assert bus.read(65, 1) == 0x04
    assert bus.read(40, 1) == 0
    assert effort(plant) == pytest.approx(0.0, abs=1e-6)


GOALS = st.tuples(st.just(41), st.binary(min_size=7, max_size=7))
WRITES = st.lists(st.one_of(GOALS, st.tuples(st.integers(5, 55), st.binary(min_size=1, max_size=8))), max_size=12)


@given(st.sampled_from(["HLS3606M", "STS3215", "SCS0009"]), WRITES)
@example("SCS0009", [(41, b"\1" * 7), (9, bytes(4)), (41, b"\2" * 7)])
def test_a_goal_changes_the_settings_as_reading_all_registers_does(name, writes):
    kernel = Kernel()
    shafts = Shafts(kernel, Bench(), loop_period_s=0.001, refresh_period_s=0.01)
    parameters = replace(HLS3606M, model=name)
    known, anew = (Servo(1, Mounting(0, 1, 2048.0), parameters, kernel, shafts, seed=0) for _ in range(2))
    for address, data in writes:
        known.write(address, data)
        anew._asked = None
        anew.write(address, data)
        assert known._wanted == anew._wanted
        assert known.memory.bytes == anew.memory.bytes
