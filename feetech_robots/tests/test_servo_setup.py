"""Setting up servos: values, refusals, lost answers and echoes, on emulated servos in virtual time."""

import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from feetech_robots.feetech_bus import FeetechBus, request
from feetech_robots.robot_bus import RobotBus
from feetech_robots.servo_setup import ServoBusError, ServoSetup, ServoValueError

from hil.cli import main

from .conftest import served

MJCF = '<body><joint name="j{0}" armature="0.01"/><geom size="0.01" mass="0.1"/></body>'


@pytest.fixture
def build(tmp_path):
    """Return a robot with one servo of each model, IDs from 1, and what sets it up; `line` is put before its bus."""

    def robot(*models, line=lambda link: link, ids=None):
        joints = "".join(MJCF.format(number) for number, _ in enumerate(models))
        (tmp_path / "r.xml").write_text(f"<mujoco><worldbody>{joints}</worldbody></mujoco>")
        rows = [
            f'[[servos]]\nid = {number}\nmodel = "{model}"\njoint = "j{at}"\nzero_counts = {500 + at}\n'
            for at, (number, model) in enumerate(zip(ids or range(1, 9), models, strict=False))
        ]
        (tmp_path / "r.toml").write_text('mjcf = "r.xml"\n' + "".join(rows))
        built = RobotBus.of_file(tmp_path / "r.toml")
        return built, ServoSetup(FeetechBus(line(built.link(115_200 if models == ("SM8512BL",) else 1_000_000))))

    return robot


def power_cycled(robot, servo, register):
    robot.power_cycle()
    return robot.peek(servo, register)


@pytest.mark.parametrize("model", ["HLS3606M", "STS3215", "SM8512BL", "SCS0009"])
def test_what_is_set_is_there_after_a_power_cycle_and_locked(build, model):
    robot, setup = build(model)
    setup.set_id(1, 7)
    assert setup.scan((1, 7)) == [7]
    setup.set_angle_limits(7, 100, 900)
    assert setup.read_out(7).limits_counts == (100, 900)
    assert robot.peek(7, "lock") == 1
    assert (power_cycled(robot, 7, "min_angle"), robot.peek(7, "max_angle")) == (100, 900)


def test_currents_and_the_middle(build):
    robot, setup = build("HLS3606M", "STS3215")
    for servo, limit in ((1, 1000), (2, 400)):
        setup.set_current_limit(servo, limit)
        setup.centre(servo)
        assert (setup.read_out(servo).current_limit, robot.peek(servo, "lock")) == (limit, 1)
        assert setup.read_out(servo).position_counts == pytest.approx(2048, abs=3)


@pytest.mark.parametrize(
    ("ask", "reason"),
    [
        (lambda setup: setup.set_id(2, 1), "ID 1 is taken"),
        (lambda setup: setup.set_id(2, 254), "0 to 253, got 254"),
        (lambda setup: setup.set_id(254, 1), "0 to 253, got 254"),
        (lambda setup: setup.set_id(9, 3), "no servo answers at ID 9"),
        (lambda setup: setup.set_current_limit(1, 1024), "0 to 1023 units, got 1024"),
        (lambda setup: setup.set_angle_limits(1, 100, 100), "low < high"),
        (lambda setup: setup.set_angle_limits(1, 0, 4096), "<= 4095"),
        (lambda setup: setup.set_angle_limits(2, 0, 1024), "SCS0009 are 0 <= low < high <= 1023"),
        (lambda setup: setup.set_angle_limits(2, 0, 0), "put an SCS0009 into motor mode"),
        (lambda setup: setup.set_current_limit(2, 100), "SCS0009, which has no protection current"),
        (lambda setup: setup.centre(2), r"\(SCS0009\) does not support `centre`"),
        (lambda setup: setup.set_id(3, 8), "of model 1295 .*registers are not known"),
        (lambda setup: setup.set_angle_limits(3, 1, 9), "nothing was written"),
    ],
)
def test_what_is_refused_is_refused_before_anything_is_written(build, ask, reason):
    robot, setup = build("HLS3606M", "SCS0009", "SCS15")
    before = [bytes(servo.memory.bytes[:56]) for servo in robot.chain.servos]
    with pytest.raises(ServoBusError, match=reason):
        ask(setup)
    assert [bytes(servo.memory.bytes[:56]) for servo in robot.chain.servos] == before


def test_two_servos_with_one_id_are_left_alone(build):
    _, setup = build("HLS3606M", "HLS3606M", ids=(3, 3))
    assert setup.scan((2, 3)) == [3]
    for refused in (setup.read_out, setup.centre, lambda servo: setup.set_id(servo, 4)):
        with pytest.raises(ServoBusError, match="two servos shared that ID"):
            refused(3)


class Line:
    """A line between master and bus that changes what arrives."""

    def __init__(self, link):
        self.link = link
        self.received = b""

    def write(self, data):
        self.link.write(data)
        self.sent = data

    def read(self, size, timeout):
        self.received += self.arrive(self.link.read(64, timeout))
        data, self.received = self.received[:size], self.received[size:]
        return data

    def arrive(self, data):
        return data

    def discard_input(self):
        self.link.discard_input()
        self.received = b""


class Echo(Line):
    def arrive(self, data):
        sent, self.sent = self.sent, b""
        return sent + data


class AcknowledgesAsNew(Line):
    """The write of an ID is acknowledged with the new one."""

    def arrive(self, data):
        return request(self.sent[6], 0) if self.sent[4:6] == b"\x03\x05" else data


class LosesAcknowledgements(Line):
    def arrive(self, data):
        return b"" if self.sent[4:5] == b"\x03" else data


@pytest.mark.parametrize("line", [Echo, AcknowledgesAsNew, LosesAcknowledgements])
@pytest.mark.parametrize("model", ["STS3215", "SCS0009"])
def test_an_answer_that_is_echoed_changed_or_lost_is_looked_after(build, line, model):
    robot, setup = build(model, line=line)
    setup.set_id(1, 7)
    setup.set_angle_limits(7, 100, 900)
    assert (power_cycled(robot, 7, "max_angle"), robot.peek(7, "lock")) == (900, 1)


def test_what_a_servo_does_not_keep_is_put_back_and_locked(build):
    robot, setup = build("STS3215")
    servo = robot.chain.servos[0]
    write = servo.write
    servo.write = lambda address, data: write(
        address, b"\xe8\x03" if address == 9 and data[2:] == b"\x84\x03" else data
    )
    assert robot.peek(1, "min_angle") == 0
    with pytest.raises(ServoBusError, match="register 9; what it held was put back"):
        setup.set_angle_limits(1, 100, 900)
    assert (robot.peek(1, "min_angle"), robot.peek(1, "max_angle"), robot.peek(1, "lock")) == (0, 4095, 1)


def test_a_line_that_only_gives_back_what_is_sent_has_no_servo():
    told = CliRunner().invoke(main, ["servos", "check", "loop://", "--ids", "1-10"])
    assert told.exit_code == 3
    assert "no servo answers at loop://; the line only echoes what is sent" in told.output
    assert CliRunner().invoke(main, ["servos", "--port", "loop://", "show", "1"]).exit_code == 3


def test_a_voltage_error_is_no_echo(build):
    """The answer to a ping with that bit set is the ping itself."""
    robot, setup = build("STS3215")
    robot.supply(3.0)
    robot.wait(0.3)
    assert setup.scan((1, 2)) == [1]
    assert setup.read_out(1).status == 1


def test_a_port_that_is_not_there():
    with (
        pytest.raises(ServoBusError, match="cannot use the bus adapter: cannot open /dev/no"),
        ServoSetup.open("/dev/no-such-adapter"),
    ):
        pass


def test_the_command_line(tmp_path):
    with served(tmp_path, start="bare", ids="5") as (_, bus):

        def run(*arguments):
            return CliRunner().invoke(main, ["servos", "--port", str(bus), *map(str, arguments)])

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
    assert issubclass(ServoValueError, ServoBusError)


def test_two_ids_of_a_hand_are_exchanged_as_the_page_of_diagnosis_says(tmp_path):
    page = (Path(__file__).parents[2] / "docs/diagnosis.md").read_text(encoding="utf-8")
    typed = re.findall(r"^aero-hil (servos .*)$", page, re.M)
    assert [line for line in typed if "set-id" in line]
    with served(tmp_path, start="homed") as (_, bus):
        runs(f"servos --port {bus} set-angles 5 100 900")
        for line in typed:
            runs(line.replace("/dev/ttyUSB0", str(bus)))
        marked = [servo for servo in range(7) if "(100, 900)" in runs(f"servos --port {bus} show {servo}")]
    assert marked == [4]


def runs(line):
    """Run a command within this process, and return its output; warnings of `check` are no failure."""
    ran = CliRunner().invoke(main, line.split())
    assert ran.exit_code == 0, ran.output
    return ran.output
