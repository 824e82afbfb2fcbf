"""`aero-hil emulate` as a user starts it: links, state file, signals."""

import contextlib
import fcntl
import json
import os
import signal
import subprocess
import sys
import tty
from pathlib import Path

import serial
from click.testing import CliRunner

from aero_hil_terminal import Terminal
from hil.cli import main

ROOT = Path(__file__).parents[2]
PATIENCE_S = 20.0


@contextlib.contextmanager
def emulating(*arguments, by):
    command = [sys.executable, "-m", "hil.cli", "emulate", *map(str, arguments)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process.stdout.readline().split()
        finally:
            process.send_signal(by)
            assert process.wait(PATIENCE_S) == 0


def test_calibration_survives_a_restart_and_nothing_is_left_behind(tmp_path):
    link, bus_link, state = tmp_path / "hand", tmp_path / "bus", tmp_path / "state.json"
    options = ("--firmware", "0.1.0", "--link", link, "--bus-link", bus_link, "--state", state)
    extends = []
    for by in (signal.SIGTERM, signal.SIGINT):
        with emulating(*options, by=by) as said:
            assert said == ["ready", str(link)]
            with serial.Serial(str(link), timeout=PATIENCE_S) as board, serial.Serial(str(bus_link), 1_000_000) as bus:
                board.write(bytes.fromhex("03 00 03 00 F6 FF").ljust(16, b"\0"))
                extends.append(int.from_bytes(board.read(16)[4:6], "little"))
                bus.timeout = PATIENCE_S
                bus.write(bytes.fromhex("FF FF 03 02 01 F9"))
                assert bus.read(6) == bytes.fromhex("FF FF 03 02 00 FA")
        assert not link.is_symlink()
        assert not bus_link.is_symlink()
    assert extends == [3278 - 113, 3278 - 226]
    assert json.loads(state.read_text())["ext3"] == extends[-1]


def test_a_killed_emulator_leaves_a_link_that_the_next_one_replaces(tmp_path):
    """Though the terminal's number is another program's by then."""
    link = tmp_path / "hand"
    command = [sys.executable, "-m", "hil.cli", "emulate", "--link", str(link)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as killed:
        assert killed.stdout.readline().split() == ["ready", str(link)]
        killed.kill()
    with Terminal() as taken:
        link.unlink()
        link.symlink_to(taken.path)
        fcntl.lockf(taken._client, fcntl.LOCK_UN)  # not an emulator's
        with emulating("--link", link, by=signal.SIGTERM) as said:
            assert said == ["ready", str(link)]


def test_a_link_that_is_served_is_left_alone(tmp_path):
    link = tmp_path / "hand"
    with emulating("--link", link, by=signal.SIGTERM) as said:
        assert said == ["ready", str(link)]
        assert CliRunner().invoke(main, ["emulate", "--link", str(link)]).exit_code == 2
        with serial.Serial(str(link), timeout=PATIENCE_S) as board:
            board.write(bytes.fromhex("25").ljust(16, b"\0"))
            assert len(board.read(16)) == 16


def test_a_bus_port_that_goes_away_ends_it_with_one_line(tmp_path):
    device, client = os.openpty()
    tty.setraw(client)
    command = [sys.executable, "-m", "hil.cli", "emulate", "--bus-port", os.ttyname(client)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline().startswith("ready")
        os.close(device)
        os.close(client)
        errors = process.communicate(timeout=PATIENCE_S)[1]
    assert process.returncode == 3
    assert "servos' port" in errors.replace("\n", " ")
    assert "Traceback" not in errors
