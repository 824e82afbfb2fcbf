"""Hypothesis without deadlines, and servos of a hand's board on a bus of their own."""

import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

from hypothesis import settings

SERVE = Path(__file__).parents[2] / "tests/firmware_emulator/serve_bench.py"
settings.register_profile("dev", max_examples=30, deadline=None)
settings.load_profile("dev")


@contextmanager
def served(folder, *, start="homed", ids="0123456"):
    """A hand in its own process; yields the links of its board and its bus."""
    link, bus_link = folder / "hand", folder / "bus"
    process = subprocess.Popen(
        [sys.executable, str(SERVE), str(link), str(bus_link), "0.2.0", start, ids, "HLS3606M"],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout.readline() == f"ready {link}\n"
        yield link, bus_link
    finally:
        process.send_signal(signal.SIGTERM)
        with process.stdout:
            assert process.wait(60) == 0
