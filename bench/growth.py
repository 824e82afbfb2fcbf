"""How the emulated hand's cost grows: with hand time, with the length of a recording, with hands side by side.

Prints one row for each size: processor time a second of hand time, memory that is held, size of the recording. Run it
with `python bench/growth.py time`, `... recording` or `... hands`; `docs/speed.md` has the curves.
"""

from __future__ import annotations

import gc
import resource
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import hil
from hil.recordings.recorder import Recorder
from hil.targets.target import Target

PERIOD_S = 0.05
"""From one reading and command to the next, s."""


def held_mb() -> float:
    """Return the memory of this process, MB."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 1e6


def stream(target: Target, seconds: float, recorder: Recorder | None = None) -> None:
    """Read and command a hand at 20 Hz."""
    start = target.clock.now()
    for i in range(round(seconds / PERIOD_S)):
        target.clock.sleep_until(start + i * PERIOD_S)
        codes = target.hand.read_codes()
        target.hand.command_codes(np.full(7, 37 * i % 30000, np.uint16))
        if recorder is not None:
            recorder.add("codes", target.clock.now(), codes)


def over_time(most_s: float) -> None:
    """One hand that is streamed to, nothing recorded but its wire."""
    with hil.open_target("emulated") as target:
        seconds = 60.0
        done = 0.0
        while seconds <= most_s:
            start = time.process_time()
            stream(target, seconds - done)
            spent = time.process_time() - start
            print(f"{seconds:8.0f} s of hand time: {1e3 * spent / (seconds - done):6.2f} ms/s, {held_mb():7.1f} MB")
            done, seconds = seconds, 2.0 * seconds


def over_recording(most_s: float) -> None:
    """Recordings of growing length, each of its own."""
    seconds = 60.0
    while seconds <= most_s:
        with TemporaryDirectory() as folder, hil.open_target("emulated") as target:
            path = Path(folder) / "run.mcap"
            before = held_mb()
            recorder = Recorder(target, "replay", path)
            recorder.begin()
            start = time.process_time()
            stream(target, seconds, recorder)
            recorder.finish()
            spent, size = time.process_time() - start, path.stat().st_size / 1e6
        print(
            f"{seconds:8.0f} s recorded: {1e3 * spent / seconds:6.2f} ms/s, {size:7.2f} MB on disk, "
            f"{held_mb() - before:7.1f} MB more held"
        )
        seconds *= 2.0


def over_hands(most: int, seconds: float = 10.0) -> None:
    """Hands side by side in one process, each streamed to for the same time."""
    count = 1
    while count <= most:
        with ExitStack() as stack:
            before = held_mb()
            targets = [stack.enter_context(hil.open_target("emulated", seed=seed)) for seed in range(count)]
            start = time.process_time()
            for target in targets:
                stream(target, seconds)
            spent = time.process_time() - start
            each, memory = 1e3 * spent / seconds / count, (held_mb() - before) / count
            print(f"{count:4} hands: {each:6.2f} ms/s a hand, {memory:6.2f} MB a hand")
        count = most if count < most < 3 * count else 3 * count


if __name__ == "__main__":
    what, size = sys.argv[1], float(sys.argv[2]) if len(sys.argv) > 2 else 0.0
    {
        "time": lambda: over_time(size or 3840.0),
        "recording": lambda: over_recording(size or 960.0),
        "hands": lambda: over_hands(int(size or 100)),
    }[what]()
