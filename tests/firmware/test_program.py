"""A sketch of our own through the whole path: build, boot, frames, homing, faults."""

import struct

import pytest

from aero.clock import WallClock
from aero.serial_transport import SerialTransport
from firmware_emulator.bench import Bench
from firmware_emulator.firmware.nvs import Nvs
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import InProcessLink
from firmware_emulator.native import program as native_program
from firmware_emulator.native.build import FirmwareBuildError, build
from firmware_emulator.native.program import FirmwareProgramError
from hil.emulated.any_hand import open_target
from hil.emulated.emulated_spec import EmulatedSpec
from hil.emulated.pty_process import serve_in_child
from tests.firmware.conftest import SKETCH


class Host:
    def __init__(self, program, **options):
        self.hand = EmulatedHand(Bench(), program=program, **options)
        self.link = InProcessLink(self.hand)
        self.link.log = []

    def ask(self, opcode, *words, timeout=0.05):
        self.link.discard_input()
        self.link.write(struct.pack("<BB7H", opcode, 0, *words, *[0] * (7 - len(words))))
        return self.link.read(16, timeout)

    def wait(self, seconds):
        self.hand.clock.sleep_until(self.hand.clock.now() + seconds)


@pytest.fixture
def host(program):
    hosts = []

    def start(**options):
        hosts.append(Host(program, **options))
        return hosts[-1]

    yield start
    for each in hosts:
        each.hand.close()


def test_it_boots_at_its_time_and_answers(host):
    on = host(start="reset")
    on.wait(0.2)
    assert on.link.log == [(0.1, "<", b"[BOOT] 1, reason 2\n")]
    on.ask(0x11, *[1000 + 100 * servo for servo in range(7)])
    on.wait(1.0)
    found = struct.unpack("<7H", on.ask(0x22)[2:])
    assert all(abs(at - 1000 - 100 * servo) < 30 for servo, at in enumerate(found))


def test_what_it_stores_outlives_a_reset_and_a_restart_of_its_own(host):
    nvs = Nvs()
    on = host(start="power_on", nvs=nvs)
    on.wait(0.2)
    on.hand.reset("brown_out")
    on.wait(0.2)
    on.ask(0x73)
    on.wait(0.2)
    assert b"".join(data for _, way, data in on.link.log if way == "<") == (
        b"[BOOT] 1, reason 1\n[BOOT] 2, reason 9\n[BOOT] 3, reason 3\n"
    )
    assert dict(nvs.items()) == {"boots": 3}


def test_two_runs_are_the_same_to_the_last_digit(host):
    logs = []
    for _ in range(2):
        on = host(start="reset")
        for at in range(20):
            on.ask(0x22 if at % 2 else 0x11, *[100 * at] * 7, timeout=0.0037)
        logs.append(on.link.log)
    assert logs[0] == logs[1]


def test_a_hand_in_use_starts_with_a_program_that_has_homed(host):
    on = host(start="homed")
    assert all(servo.memory.get("offset") for servo in on.hand.servos)
    assert on.link.log == []
    assert on.ask(0x22)[:1] == b"\x22"


def test_a_loop_without_a_poll_is_named(host, monkeypatch):
    monkeypatch.setattr(native_program, "RESPONSE_TIMEOUT_S", 0.3)
    on = host(start="reset")
    on.wait(0.2)
    with pytest.raises(FirmwareProgramError, match=r"task 'loopTask' runs without ever waiting or polling; .*Serial"):
        on.ask(0x70)


def test_what_the_board_lacks_is_named(host):
    on = host(start="reset")
    on.wait(0.2)
    with pytest.raises(FirmwareProgramError, match=r"WiFi\.begin\(\) is not on the emulated board"):
        on.ask(0x72)


def test_a_sanitizer_stops_an_overrun_with_file_and_line(compiler, tmp_path):
    out = tmp_path / "checked"
    build(SKETCH, out, sanitize=["undefined"])
    on = Host(out, start="reset")
    on.wait(0.2)
    assert on.ask(0x71, 6) == bytes((0x71, 0, *[0] * 12, 1, 0))
    line = 1 + (SKETCH / "sketch.ino").read_text().splitlines().index("      words[payload[0]] = 1;")
    with pytest.raises(FirmwareProgramError, match=rf"sketch\.ino:{line}"):
        on.ask(0x71, 7)


def test_it_drives_a_target_and_a_terminal(program):
    with open_target("emulated", firmware_program=str(program)) as opened:
        assert opened.hand.read_codes() is not None
    served = serve_in_child(EmulatedSpec(firmware_program=program))
    with served as (path, _):
        transport = SerialTransport.open(path)
        clock = WallClock()
        transport.write(struct.pack("<BB7H", 0x22, 0, *[0] * 7))
        deadline = clock.now() + 5.0
        got = b""
        while len(got) < 16 and clock.now() < deadline:
            got += transport.read(16 - len(got), 0.5)
        transport.close()
    assert got[:2] == b"\x22\x00"
    assert len(got) == 16


def test_a_physical_hand_runs_its_own_firmware(program):
    with pytest.raises(ValueError, match="runs on an emulated hand"):
        open_target("/dev/ttyACM0", firmware_program=program)


def test_a_mistake_in_a_sketch_is_shown_with_its_line(compiler, tmp_path):
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "broken.ino").write_text("void setup() {}\n\nvoid loop() { nothing(); }\n")
    with pytest.raises(FirmwareBuildError, match=r"broken\.ino:3"):
        build(tmp_path / "broken", tmp_path / "out")
