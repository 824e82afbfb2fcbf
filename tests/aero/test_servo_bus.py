"""Setting up servos, on emulated ones behind a pseudo-terminal in their own process."""

import pytest
import scservo_sdk as feetech
from click.testing import CliRunner

from aero.servo_bus import ServoBusError, ServoSetup
from hil.cli import main
from tests.firmware_emulator.test_clients import served


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    """A loaded machine may answer late; only a missing servo costs this time."""
    monkeypatch.setattr(feetech.port_handler, "LATENCY_TIMER", 200)


@pytest.fixture
def bus(tmp_path, request):
    with served(tmp_path, start="bare", ids=request.param) as (_, bus_link):
        yield str(bus_link)


@pytest.mark.parametrize("bus", ["14"], indirect=True)
def test_setting_up_servos_and_what_is_refused(bus):
    with ServoSetup(bus) as setup:
        seen = []
        assert setup.scan((1, 2, 4), seen.append) == [1, 4]
        assert seen == [1, 2, 4]
        before = setup.read_out(4)
        assert (before.id, before.model, before.angle_limits_counts, before.current_limit) == (4, 2570, (0, 4095), 1023)
        assert (before.voltage, before.status) == (6.0, 0)
        setup.set_id(4, 4)
        setup.set_id(4, 2)
        assert setup.scan((1, 2, 4)) == [1, 2]
        setup.set_current_limit(2, 800)
        setup.set_angle_limits(2, 100, 4000)
        setup.centre(2)
        after = setup.read_out(2)
        assert (after.current_limit, after.angle_limits_counts, after.position_counts) == (800, (100, 4000), 2048)
        setup.set_angle_limits(2, 0, 0)
        assert setup.read_out(2).angle_limits_counts == (0, 0)
        for refused, reason in (
            (lambda: setup.set_id(2, 1), "ID 1 is taken"),
            (lambda: setup.set_id(2, 254), "0 to 253, got 254"),
            (lambda: setup.set_id(254, 1), "0 to 253, got 254"),
            (lambda: setup.set_id(9, 3), "no servo answers at ID 9"),
            (lambda: setup.set_current_limit(2, 1024), "0 to 1023 units, got 1024"),
            (lambda: setup.set_angle_limits(2, 100, 100), "low < high"),
            (lambda: setup.set_angle_limits(2, 0, 4096), "<= 4095"),
        ):
            with pytest.raises(ServoBusError, match=reason):
                refused()
        assert setup.read_out(2).current_limit == 800


@pytest.mark.parametrize("bus", ["33"], indirect=True)
def test_two_servos_with_one_id_are_left_alone(bus):
    with ServoSetup(bus) as setup:
        assert setup.scan((2, 3)) == [3]
        for refused in (setup.read_out, setup.centre, lambda servo: setup.set_id(servo, 4)):
            with pytest.raises(ServoBusError, match="two servos shared that ID"):
                refused(3)


def test_a_port_that_is_not_there():
    with pytest.raises(ServoBusError, match="is the adapter plugged in"):
        ServoSetup("/dev/no-such-adapter")


@pytest.mark.parametrize("bus", ["5"], indirect=True)
def test_the_command_line(bus):
    def run(*arguments):
        return CliRunner().invoke(main, ["servos", "--port", bus, *map(str, arguments)])

    assert run("set-id", 5, 6).output == "servo 5 is servo 6 now\n"
    assert run("set-current", 6, 1000).exit_code == 0
    assert run("set-angles", 6, 0, 0).exit_code == 0
    assert run("centre", 6).exit_code == 0
    shown = run("show", 6).output
    assert "current_limit          1000" in shown
    assert "position_counts        2048" in shown
    refused = run("set-current", 6, 5000)
    assert refused.exit_code == 2
    assert "0 to 1023" in refused.output


@pytest.mark.slow
@pytest.mark.parametrize("bus", ["5"], indirect=True)
def test_the_command_line_scans(bus, monkeypatch):
    monkeypatch.setattr(feetech.port_handler, "LATENCY_TIMER", 34)
    assert CliRunner().invoke(main, ["servos", "--port", bus, "scan"]).output == "5\n"
