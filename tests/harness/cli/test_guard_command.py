"""`aero-hil guard` as a user starts it: the maker's SDK behind it, its words, its endings and its black box."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import serial
from click.testing import CliRunner
from served_command import PATIENCE_S, commands, serving

from aero import AeroHand
from aero.protocol import FRAME_SIZE, MAX_CODE, READINGS, make_positions, make_query
from hil.cli import main
from hil.recordings.mcap_file import read_recording

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the end of a client shows on Linux only")

SESSION = Path(__file__).parents[2] / "support" / "sdk_session.py"
FIST = make_positions([50000] * 4 + [0, 0, 0])


def through_a_guard(folder, session):
    """Run a session of the SDK on a hand, and another one behind a guard, and return both hands' recordings."""
    with (
        serving("emulate", "--link", "bare", "--record", "bare.mcap", folder=folder),
        serving("emulate", "--link", "hand", "--record", "hand.mcap", folder=folder),
        serving("guard", "hand", "--link", "guarded", folder=folder) as guard,
    ):
        programs = [
            subprocess.Popen([sys.executable, SESSION, port, session], cwd=folder, text=True, stdout=subprocess.PIPE)
            for port in ("bare", "guarded")
        ]
        said = [json.loads(one.communicate(timeout=PATIENCE_S)[0].splitlines()[-1]) for one in programs]
    assert "stopped" not in guard.said, guard.said
    assert said[0] == said[1]
    assert not (folder / "stops").exists()
    return commands(folder / "bare.mcap"), commands(folder / "hand.mcap")


def test_the_whole_sdk_sends_the_same_bytes_behind_a_guard(tmp_path):
    bare, guarded = through_a_guard(tmp_path, "api")
    assert bare == guarded
    assert len(bare) > 80


@pytest.mark.slow
def test_the_sequence_of_the_sdk_sends_the_same_bytes_behind_a_guard(tmp_path):
    bare, guarded = through_a_guard(tmp_path, "sequence")
    assert bare == guarded
    assert len(bare) == 900


def test_a_stop_is_told_recorded_and_taken_back_by_a_word_typed_after_it(tmp_path):
    with (
        serving("emulate", "--link", "hand", folder=tmp_path),
        serving("guard", "hand", "--link", "guarded", "--prompt", folder=tmp_path) as guard,
    ):
        guard.types("status\nresume\nhelp\n")
        guard.says("^passing")
        guard.says("`resume` accepts commands again")
        with serial.Serial(str(tmp_path / "guarded"), timeout=5.0) as client:
            client.write(FIST)
            client.write(make_query(READINGS[0]))
            assert len(client.read(FRAME_SIZE)) == FRAME_SIZE
        guard.types("resume\n")  # before the stop is told
        guard.says("^stopped and opened slowly. The client closed the port")
        path = tmp_path / guard.says(r"^recorded in (\S+)")[1]
        with AeroHand.open_unguarded(str(tmp_path / "guarded")) as client:
            client.command_codes([MAX_CODE] * 7)
            assert client.read_codes().max() < 0.1 * MAX_CODE
            client._clock.sleep_until(client._clock.now() + 0.5)
            assert client.read_codes().max() < 0.1 * MAX_CODE
            guard.types("status\n")
            guard.says("^refusing, 1 commands refused")
            guard.types("resume\n")
            guard.says("^resumed")
            client.command_codes([30000] * 4 + [0] * 3)
            client._clock.sleep_until(client._clock.now() + 1.0)
            assert client.read_codes()[:4].min() > 20000
            client.command_codes([0] * 7)
            client._clock.sleep_until(client._clock.now() + 1.0)
        recording = read_recording(path)
        assert FIST in [record.data for record in recording.wire]
        assert [event.severity for event in recording.events] == ["error"]
    assert guard.said.count("stopped and opened") == 1
    assert not (tmp_path / "guarded").is_symlink()


@pytest.mark.slow
def test_a_guard_that_ends_opens_the_hand_and_one_that_is_killed_leaves_that_to_its_second_process(tmp_path):
    with serving("emulate", "--link", "hand", folder=tmp_path):
        for number, code in ((signal.SIGTERM, 0), (signal.SIGKILL, -signal.SIGKILL)):
            with serving("guard", "hand", "--link", "guarded", folder=tmp_path, stop=number, code=code):
                client = serial.Serial(str(tmp_path / "guarded"), timeout=5.0)
                client.write(FIST)
                client.write(make_query(READINGS[0]))
                assert len(client.read(FRAME_SIZE)) == FRAME_SIZE
            client.close()
            until = time.monotonic() + PATIENCE_S
            while True:
                try:
                    with AeroHand.open_unguarded(str(tmp_path / "hand")) as hand:
                        if hand.read_codes().max() < 0.1 * MAX_CODE:
                            break
                except ConnectionError:
                    pass  # the second process has the port
                assert time.monotonic() < until


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (["/dev/ttyNoSuchHand"], 3, "no such port"),
        (["emulated"], 2, "aero-hil emulate --link PATH"),
        (["nobody"], 2, "no hand is called"),
        (["/dev/null", "--black-box", "taken", "--link", "taken"], 2, "taken is also"),
    ],
)
def test_bad_usage_is_one_line(arguments, code, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(main, ["guard", *arguments])
    assert (result.exit_code, says in result.stderr) == (code, True), result.stderr
    assert not list(tmp_path.iterdir())


def test_the_command_loads_no_emulator():
    program = "import sys, hil.cli.guard; print(*sys.modules)"
    ran = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    loaded = {name.partition(".")[0] for name in ran.stdout.split()}
    assert not loaded & {"firmware_emulator", "simulator", "model", "mujoco", "mcap"}
