"""What a driver of this bus must get right: `pytest tests/bus_driver --bus-driver=my_package.my_module:factory`.

See docs/bus_drivers.md. A driver may return a right value or tell of a failure by any exception; a wrong value is never
right. Each test's first line is its row in the table that the run ends with.
"""

import pytest
from tests.bus_driver.conftest import ReportedFailure, asked, attempted

MULTI_TURN = 0x10 | 12
LATE_S = 0.2
"""Later than any time-out of the drivers that were tried, 34 to 55 ms."""


def test_registers_of_one_and_two_bytes_are_read(bus):
    driver, served = bus
    served.order("poke", 1, "goal_position", 1234)
    assert asked(driver.read, 1, "goal_position") == 1234
    assert asked(driver.read, 1, "present_voltage") == 120
    assert asked(driver.read, 2, "present_position") == served.peek(2, "present_position") == 2000


def test_a_negative_position_is_read(bus):
    """Sign bit 15, with bit 4 of the phase register."""
    driver, served = bus
    served.order("poke", 1, "phase", MULTI_TURN)
    served.order("hold", "first", -180)
    served.pass_time(1.5)
    assert asked(driver.read, 1, "present_position") == pytest.approx(1000 - 2048, abs=2)


def test_a_negative_speed_is_read(bus):
    """Sign bit 15."""
    driver, served = bus
    served.order("poke", 1, "mode", 1)
    served.order("poke", 1, "goal_speed", -500)
    served.pass_time(1.0)
    assert asked(driver.read, 1, "present_speed") == pytest.approx(-500, abs=25)


@pytest.mark.parametrize("duty", [300, -300])
def test_a_load_is_read_with_its_sign(bus, duty):
    """Sign bit 10."""
    driver, served = bus
    served.order("poke", 1, "mode", 2)
    served.order("poke", 1, "goal_pwm", duty)
    served.pass_time(0.5)
    assert asked(driver.read, 1, "present_load") == duty


def test_a_negative_offset_is_read(bus):
    """Sign bit 11."""
    driver, served = bus
    served.order("poke", 1, "offset", -1000)
    assert asked(driver.read, 1, "offset") == -1000


def test_a_negative_goal_is_written(bus):
    """Sign bit 15."""
    driver, served = bus
    served.order("poke", 1, "phase", MULTI_TURN)
    asked(driver.write, 1, "goal_position", -500)
    assert served.peek(1, "goal_position") == -500


def test_a_negative_offset_is_written(bus):
    """Sign bit 11."""
    driver, served = bus
    asked(driver.write, 1, "offset", -1000)
    assert served.peek(1, "offset") == -1000


def test_two_byte_registers_of_an_scs_servo_are_read_and_written(make_bus):
    """High byte first."""
    driver, served = make_bus("big_endian.toml", {1: "SCS0009"})
    assert asked(driver.read, 1, "present_position") == pytest.approx(700, abs=1)
    asked(driver.write, 1, "goal_position", 300)
    assert served.peek(1, "goal_position") == 300


def test_a_sync_read_gives_each_servo_its_own_value(bus):
    driver, _ = bus
    assert dict(asked(driver.sync_read, "present_position", (1, 2, 3))) == {1: 1000, 2: 2000, 3: 3000}


def test_a_sync_write_reaches_each_servo(bus):
    driver, served = bus
    asked(driver.sync_write, "goal_position", {1: 1100, 2: 2200, 3: 3300})
    served.pass_time(0.05)
    assert [served.peek(servo, "goal_position") for servo in (1, 2, 3)] == [1100, 2200, 3300]


@pytest.mark.parametrize("silent", [1, 2, 3])
def test_a_sync_read_gives_no_number_for_a_silent_servo(bus, silent):
    driver, served = bus
    right = {1: 1000, 2: 2000, 3: 3000}
    assert dict(asked(driver.sync_read, "present_position", (1, 2, 3))) == right
    served.order("silence", silent, 60)
    found = attempted(driver.sync_read, "present_position", (1, 2, 3))
    if not isinstance(found, ReportedFailure):
        assert found.get(silent) is None
        assert {servo: value for servo, value in found.items() if value is not None}.items() <= right.items()


def test_the_sync_read_after_a_silent_servo_is_right(bus):
    driver, served = bus
    served.order("silence", 1, 0.3)
    attempted(driver.sync_read, "present_position", (1, 2, 3))
    served.pass_time(0.4)
    assert dict(asked(driver.sync_read, "present_position", (1, 2, 3))) == {1: 1000, 2: 2000, 3: 3000}


def test_a_read_of_a_silent_servo_is_reported(bus):
    driver, served = bus
    served.order("silence", 2, 60)
    assert isinstance(attempted(driver.read, 2, "present_position"), ReportedFailure)


def test_a_write_to_a_silent_servo_is_reported(bus):
    driver, served = bus
    served.order("silence", 2, 60)
    assert isinstance(attempted(driver.write, 2, "goal_position", 2100), ReportedFailure)


def test_a_write_that_is_acknowledged_with_an_error_is_reported(bus):
    """A hot servo takes the goal, sets bit 2 of the error byte and does not move."""
    driver, served = bus
    served.order("heat", 2, 80)
    served.pass_time(0.3)
    assert isinstance(attempted(driver.write, 2, "goal_position", 2100), ReportedFailure)


def test_a_late_answer_is_not_taken_for_the_next_register(bus):
    driver, served = bus
    served.order("poke", 1, "goal_position", 1111)
    served.order("poke", 1, "goal_speed", 222)
    served.order("late", LATE_S)
    assert isinstance(attempted(driver.read, 1, "goal_position"), ReportedFailure)
    served.pass_time(2 * LATE_S)
    found = attempted(driver.read, 1, "goal_speed")
    assert isinstance(found, ReportedFailure) or found == 222


def test_a_late_answer_is_not_taken_for_another_servos(bus):
    driver, served = bus
    served.order("late", LATE_S)
    assert isinstance(attempted(driver.read, 1, "present_position"), ReportedFailure)
    served.pass_time(2 * LATE_S)
    found = attempted(driver.read, 2, "present_position")
    assert isinstance(found, ReportedFailure) or found == 2000


def test_a_late_sync_read_does_not_shift_the_next(bus):
    driver, served = bus
    right = {1: 111, 2: 222, 3: 333}
    for servo, speed in right.items():
        served.order("poke", servo, "goal_speed", speed)
    served.order("late", LATE_S)
    assert isinstance(attempted(driver.sync_read, "present_position", (1, 2, 3)), ReportedFailure)
    served.pass_time(2 * LATE_S)
    found = attempted(driver.sync_read, "goal_speed", (1, 2, 3))
    assert isinstance(found, ReportedFailure) or dict(found) == right


def test_two_servos_of_one_id_give_no_number(make_bus):
    """1365 and 2730, which have no bit in common, meet on the wire."""
    driver, _ = make_bus("doubled.toml", {1: "STS3215", 2: "STS3215"})
    found = attempted(driver.read, 2, "present_position")
    assert isinstance(found, ReportedFailure)


def test_a_stored_offset_survives_a_power_cycle(bus):
    driver, served = bus
    asked(driver.store, 1, "offset", -1000)
    served.order("power_cycle")
    assert served.peek(1, "offset") == -1000


def test_storing_leaves_the_eeprom_locked(bus):
    driver, served = bus
    asked(driver.store, 1, "offset", -1000)
    assert served.peek(1, "lock") == 1


def test_storing_does_not_switch_the_torque_on(bus):
    driver, served = bus
    assert served.peek(1, "torque_enable") == 0
    asked(driver.store, 1, "offset", -1000)
    assert served.peek(1, "torque_enable") == 0


@pytest.mark.parametrize("raw", [0, 100, 2047, 4000, 4095])
def test_the_middle_is_the_middle_wherever_the_encoder_stands(bus, raw):
    """The offset wraps: of 4095 the difference to 2047 is 2048, which no register with its sign in bit 11 holds."""
    driver, served = bus
    served.order("hold", "first", (raw - 1000) * 360 / 4096)
    served.pass_time(1.5)
    assert served.peek(1, "present_position") == raw
    failed = asked(driver.middle, 1)
    assert served.peek(1, "present_position") == pytest.approx(2047, abs=2), failed
