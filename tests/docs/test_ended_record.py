"""A recording that is cut short keeps what it had and leaves the hand open, with no extra but `hil`."""

import signal
import subprocess
from contextlib import ExitStack, suppress

import pytest
from pages import HIL
from terminal import Terminal

from aero import AeroHand
from hil.recordings.mcap_file import read_recording

pytestmark = pytest.mark.slow


def test_a_terminated_run_keeps_what_it_had_and_opens_the_hand(tmp_path, installed):
    with ExitStack() as stack:
        terminal = Terminal(tmp_path, stack, installed(HIL))
        port, recorded = terminal.port("/dev/ttyACM0"), tmp_path / "cut.mcap"
        command = ["aero-hil", "record", "--hil", port, "--excite", "steps", "--scale", "0.4", "--out", str(recorded)]
        with subprocess.Popen(command, env=terminal.variables, stderr=subprocess.PIPE, text=True) as child:
            while child.poll() is None and (not recorded.exists() or recorded.stat().st_size < 100_000):
                with suppress(subprocess.TimeoutExpired):  # a loop without a wait would take a core from the hand
                    child.wait(0.1)
            child.send_signal(signal.SIGTERM)
            said = child.communicate(timeout=60)[1]
        assert child.returncode == 143, said
        assert "were recorded" in said
        found = read_recording(recorded)
        assert not found.header.finished
        assert found.header.duration_s > 1.0
        with AeroHand.open_unguarded(port) as hand:
            assert max(hand.read_codes()) < 0.05 * 65535
