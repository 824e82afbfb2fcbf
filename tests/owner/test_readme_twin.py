"""The commands of the README's owner section that make and use a twin of the hand, word for word."""

import os
import signal
import subprocess

import pytest
from owner_section import as_run, owner_commands, run, scripts, with_a_twin

from aero import AeroHand
from hil.recordings.mcap_file import read_recording

COMMANDS = [command for command in owner_commands() if with_a_twin(command)]

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("command", COMMANDS)
def test_the_owner_section_works_as_it_is_written(port, folder, command):
    """In order: what one command writes, the next reads."""
    ran = run(as_run(command, port), folder)
    assert ran.returncode == 0, f"{command}\n{ran.stdout[-3000:]}\n{ran.stderr[-3000:]}"


def test_a_terminated_run_keeps_what_it_had_and_opens_the_hand(port, folder):
    command = ["aero-hil", "record", "--hil", port, "--excite", "steps", "--scale", "0.4", "--out", "cut.mcap"]
    with subprocess.Popen(command, cwd=folder, env=scripts(), stderr=subprocess.PIPE, text=True) as child:
        recorded = folder / "cut.mcap"
        while child.poll() is None and (not recorded.exists() or recorded.stat().st_size < 100_000):
            os.sched_yield()
        child.send_signal(signal.SIGTERM)
        said = child.communicate(timeout=60)[1]
    assert child.returncode == 143, said
    assert "were recorded" in said
    found = read_recording(recorded)
    assert not found.header.finished
    assert found.header.duration_s > 1.0
    with AeroHand.open_unguarded(port) as hand:
        assert max(hand.read_codes()) < 0.05 * 65535
