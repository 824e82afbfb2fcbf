"""`aero-hil servos check`: each fault of a bus is found and named, a healthy bus has none; on virtual time."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from feetech_robots.feetech_bus import DamagedAnswerError, FeetechBus, NoAnswerError, parse_answer, request
from feetech_robots.robot_bus import RobotBus
from feetech_robots.servo_rules import judge, small_move
from feetech_robots.survey import READS, find, survey
from hypothesis import given
from hypothesis import strategies as st

from hil.cli.doctor.finding import Verdict

ROOT = Path(__file__).parents[1]
ARM = (ROOT / "examples/arm/arm.toml").read_text()
OLD_FIRMWARE = 'like = "STS3215"\nname = "old"\nregisters = [["firmware_minor", 1, 1, "r", 0, 255, 9, 0, "", "C"]]\n'


class Bus:
    """The arm of the examples, with its file changed."""

    def __init__(self, folder, *changes):
        text = ARM.replace('"arm.xml"', f'"{ROOT / "examples/arm/arm.xml"}"')
        for old, new in changes:
            assert old in text
            text = text.replace(old, new, 1)
        (folder / "old.toml").write_text(OLD_FIRMWARE)
        (folder / "arm.toml").write_text(text)
        self.robot = RobotBus.of_file(folder / "arm.toml")
        self.bus = FeetechBus(self.robot.link())

    def servo(self, number):
        return self.robot.chain.servos[number - 1]

    def write(self, number, address, *data):
        self.bus.write(number, address, bytes(data))
        self.robot.wait(0.05)

    def judge(self, expected=()):
        found = [survey(self.bus, servo, 1_000_000) for servo in find(self.bus, range(1, 12))]
        return list(judge(found, expected))

    def problems(self, expected=()):
        return {line.check: line for line in self.judge(expected) if line.verdict is not Verdict.OK}


@pytest.fixture
def arm(tmp_path):
    return lambda *changes: Bus(tmp_path, *changes)


def test_a_healthy_bus_has_one_good_line_a_servo(arm):
    lines = arm().judge(range(1, 7))
    assert [(line.check, line.verdict) for line in lines] == [(f"servo {servo}", "ok") for servo in range(1, 7)]
    assert "STS3215 (777), firmware 3.10, 1000000 bit/s, 12 V, " in lines[0].finding


def test_looking_changes_nothing(arm):
    bus = arm()
    before = [bytes(servo.memory.bytes[:56]) for servo in bus.robot.chain.servos]
    bus.judge()
    assert [bytes(servo.memory.bytes[:56]) for servo in bus.robot.chain.servos] == before


def test_a_servo_that_counts_turns_is_worth_a_look(arm):
    bus = arm()
    memory = bus.servo(3).memory
    memory.bytes[18] |= 0x10
    problem = bus.problems()["servo 3 settings"]
    assert problem.verdict is Verdict.LOOK
    assert "count turns" in problem.finding
    assert "register 18" in problem.remedy


def test_two_servos_with_one_id_are_told_from_a_bad_line(arm):
    doubled = arm(("id = 4", "id = 3")).problems(range(1, 7))
    assert doubled["servo 3 line"].verdict is Verdict.WRONG
    assert "two servos have this ID" in doubled["servo 3 line"].finding
    assert doubled["servo 4"].finding == "it does not answer"

    class Damage:
        def __init__(self):
            self.count = 0

        def asked(self, data):
            pass

        def answered(self, data):
            self.count += 1
            return data[:-1] + bytes((data[-1] ^ 1,)) if self.count % 3 == 0 else data

    bus = arm()
    bus.robot.chain.bus.tap = Damage()
    bad = bus.problems()
    assert "servo 3 line" in bad
    assert not any("two servos" in line.finding for line in bad.values())


def test_a_servo_that_is_silent_now_and_then_has_a_loose_plug(arm):
    bus = arm()
    (found,) = find(bus.bus, [2])
    bus.robot.silence(2, 0.1)
    seen = survey(bus.bus, found, 1_000_000)
    assert 0 < seen.silent < READS
    (line,) = [line for line in judge([seen]) if line.verdict is not Verdict.OK]
    assert "reads are not answered" in line.finding
    assert "plugs" in line.remedy


@pytest.mark.parametrize(
    ("order", "check", "words"),
    [
        (lambda bus: bus.robot.heat(2, 75.9), "servo 2 temperature", "75 °C; its torque switches off above 70 °C"),
        (lambda bus: bus.robot.heat(2, 75), "servo 2 status", "temperature (status 0x04)"),
        (lambda bus: bus.robot.heat(2, 65.9), "servo 2 temperature", "65 °C"),
        (lambda bus: bus.robot.supply(3.5), "servo 2 supply", "3.5 V is not within its limits of 4 to 14 V"),
        (lambda bus: bus.robot.supply(4.1), "servo 2 supply", "close to its lower limit"),
        (lambda bus: setattr(bus.servo(2).feedback, "volts", 11.0), "voltages", "ID 2 measures 11 V and ID 1 12 V"),
        (lambda bus: bus.write(2, 9, 0xD0, 7, 0xD0, 7), "servo 2 limits", "its angle limits are 2000 and 2000"),
        (lambda bus: bus.write(2, 9, 0, 8, 0x50, 8), "servo 2 limits", "outside its angle limits of 2048 to 2128"),
        (lambda bus: bus.write(2, 31, 0xFF, 0x0F), "servo 2 offset", "offset of -2047 is the largest"),
        (lambda bus: bus.write(2, 33, 1), "servo 2 settings", "its mode is 1"),
        (lambda bus: bus.write(2, 55, 0), "servo 2 settings", "EEPROM is unlocked"),
    ],
)
def test_each_fault_is_found_and_named(arm, order, check, words):
    bus = arm()
    order(bus)
    bus.robot.wait(0.3)
    problems = bus.problems()
    assert check in problems, problems
    assert any(words in line.finding for line in bus.judge() if line.check == check)
    assert problems[check].remedy


def test_a_servo_that_acknowledges_nothing_is_worth_a_look(arm):
    bus = arm()
    bus.write(2, 8, 0)
    with pytest.raises(NoAnswerError):
        bus.bus.write(2, 41, b"\0")
    assert "acknowledges no writes" in bus.problems()["servo 2 settings"].finding


def test_firmware_versions_of_one_model_are_compared(arm):
    line = arm(('id = 1\nmodel = "STS3215"', 'id = 1\nmodel = "old.toml"')).problems()["firmware"]
    assert line.finding == "STS3215 servos have different firmware: 3.9 (ID 1), 3.10 (ID 2 3 4 5 6)"


def test_an_offset_that_is_a_twos_complement_is_named(arm):
    """huggingface/lerobot 1296: -1000 written as 0xFC18. The emulated servo stores no such word, others may."""
    seen = survey(arm().bus, 1, 1_000_000)
    (line,) = judge([replace(seen, offset_word=0xFC18)])
    assert line.verdict is Verdict.WRONG
    assert "0xFC18, which is not a number with its sign in bit 11" in line.finding
    assert replace(seen, offset_word=1000 | 1 << 11).offset_counts == -1000


def test_servos_at_different_rates_are_listed(arm):
    seen = survey(arm().bus, 1, 1_000_000)
    (line, *_) = judge([seen, replace(seen, id=2, baud=115_200)])
    assert line.finding == "servos listen at different baud rates: ID 2 at 115200, 1 at 1000000"


def test_an_scs_servo_is_read_in_its_byte_order(arm):
    bus = arm(
        ('model = "STS3215"\njoint = "gripper"', 'model = "SCS0009"\njoint = "gripper"'),
        ("zero_counts = 1500", "zero_counts = 400"),
    )
    seen = survey(bus.bus, 6, 1_000_000)
    assert (seen.kind.name, seen.limits_counts, seen.offset_word) == ("SCS0009", (20, 1003), 0)
    assert seen.position_counts == pytest.approx(400, abs=3)
    assert small_move(bus.bus, seen, 60, bus.robot.wait).verdict is not Verdict.WRONG


def test_a_small_move_comes_back_and_leaves_the_torque_as_it_was(arm):
    bus = arm()
    seen = survey(bus.bus, 6, 1_000_000)
    before = bus.robot.joint_deg("gripper")
    line = small_move(bus.bus, seen, 100, bus.robot.wait)
    assert line.verdict is Verdict.OK
    assert line.data["spread_counts"] <= 2
    assert line.data["travel_counts"] == pytest.approx(100, abs=4)
    assert bus.servo(6).memory.get("torque_enable") == 0
    assert bus.robot.joint_deg("gripper") == pytest.approx(before, abs=1.0)


def test_a_blocked_joint_is_found_by_a_small_move(arm):
    bus = arm()
    joint = bus.robot.plant.model.joint("gripper")
    joint.range[:] = -0.001, 0.001
    line = small_move(bus.bus, survey(bus.bus, 6, 1_000_000), 100, bus.robot.wait)
    assert line.verdict is Verdict.WRONG
    assert "of 100 counts" in line.finding


def test_a_servo_that_reports_a_fault_is_not_moved(arm):
    bus = arm()
    bus.robot.heat(6, 75)
    bus.robot.wait(0.2)
    assert "not moved" in small_move(bus.bus, survey(bus.bus, 6, 1_000_000), 100, bus.robot.wait).finding


@given(st.binary(max_size=40), st.integers(0, 253), st.integers(0, 20))
def test_no_bytes_are_taken_for_an_answer_that_they_are_not(received, servo, count):
    try:
        answer = parse_answer(received, servo, count)
    except (NoAnswerError, DamagedAnswerError):
        return
    assert request(servo, answer.status, answer.data) == received


def test_golden_bytes():
    """FTServo_Arduino v2.0.0: ping, read of 15 measurements, an acknowledgement."""
    assert request(0, 1) == bytes.fromhex("FF FF 00 02 01 FC")
    assert request(0, 2, b"\x38\x0f") == bytes.fromhex("FF FF 00 04 02 38 0F B2")
    assert parse_answer(bytes.fromhex("FF FF 03 02 00 FA"), 3, 0) == (0, b"")


def test_the_command_prints_data_for_programs_and_ends_with_a_code(tmp_path):
    link = tmp_path / "arm"
    serve = [sys.executable, "-m", "hil.cli", "emulate-bus", str(ROOT / "examples/arm/arm.toml"), "--link", str(link)]
    ask = [sys.executable, "-m", "hil.cli", "servos", "check", str(link), "--ids", "1-6", "--json"]
    with subprocess.Popen(serve, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == f"ready {link}\n"
        done = subprocess.run([*ask, "--expect", "6,9"], cwd=ROOT, capture_output=True, text=True, check=False)
        process.terminate()
    document = json.loads(done.stdout)
    assert done.returncode == 1
    assert {finding["check"]: finding["verdict"] for finding in document["findings"]}["servo 9"] == "wrong"
    gone = subprocess.run(ask, cwd=ROOT, capture_output=True, text=True, check=False)
    assert gone.returncode == 3
