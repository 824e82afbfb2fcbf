"""Commands that move a hand on a port, broken off at random moments: the hand open, the data readable, the end said."""

import contextlib
import os
import random
import signal
import subprocess
import sys

import numpy as np
import pytest

from aero import AeroHand
from aero.protocol import MAX_CODE
from hil.recordings.mcap_file import read_recording

pytestmark = [pytest.mark.slow, pytest.mark.skipif(os.name != "posix", reason="needs signals and pseudo-terminals")]

COMMANDS = {
    "validate": ["validate", "--only", "audit", "--only", "holding", "--out", "results"],
    "record": ["record", "--excite", "steps", "--out", "recorded.mcap"],
    "run-policy": ["run-policy", "--seconds", "60", "--record", "policy.mcap"],
}
ENDINGS = {"SIGINT": {130, -signal.SIGINT}, "SIGTERM": {143}, "closed port": {3}}
"""What happens, and the exit codes of docs/commands.md for it. A shell makes 130 of a program that SIGINT has killed,
which is how Python ends when the signal comes in the middle of some imports."""
LAST_LINES = {"SIGINT": "Error: interrupted", "SIGTERM": "Error: terminated", "closed port": "Error: "}
MOMENTS = int(os.environ.get("BROKEN_OFF", "1"))
"""Random moments of each command and ending."""
STARTED_S, PATIENCE_S = (0.5, 12.0), 60.0
OPEN = 0.12


def aero_hil(*arguments, folder):
    command = [sys.executable, "-m", "hil.cli", *arguments]
    return subprocess.Popen(
        command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )


@contextlib.contextmanager
def served(folder):
    with aero_hil("emulate", "--link", "hand", "--seed", "5", folder=folder) as server:
        try:
            assert server.stdout.readline().startswith("ready")
            yield server
        finally:
            server.send_signal(signal.SIGTERM)
            server.communicate()


@pytest.mark.parametrize("moment", range(MOMENTS))
@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_that_is_broken_off_leaves_the_hand_open_and_what_it_had(name, ending, moment, tmp_path):
    after_s = random.Random(f"{name} {ending} {moment}").uniform(*STARTED_S)
    with served(tmp_path) as server:
        command = aero_hil(*COMMANDS[name], "--hil", "hand", folder=tmp_path)
        with contextlib.suppress(subprocess.TimeoutExpired):
            command.wait(after_s)
        if ending == "closed port":
            server.kill()
        else:
            command.send_signal(getattr(signal, ending))
        _, said = command.communicate(timeout=PATIENCE_S)
        print(f"{name}, {ending} after {after_s:.1f} s: {command.returncode}, {said.splitlines()[-1:]}")
        with pytest.raises(ProcessLookupError):
            os.killpg(command.pid, 0)
        if ending != "closed port":
            with AeroHand.open_unguarded(str(tmp_path / "hand")) as hand:
                assert np.all(hand.read_codes() < OPEN * MAX_CODE)
    assert "Traceback" not in said
    if said:  # none before Python has reached the command line
        assert command.returncode in ENDINGS[ending]
        assert said.splitlines()[-1].startswith(LAST_LINES[ending])
    for path in tmp_path.rglob("*.mcap"):
        read_recording(path)
