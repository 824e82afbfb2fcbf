"""`aero-hil emulate` as a child process, for the target `pty`."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

from hil.faults.fault import Fault
from hil.faults.schedule import NEVER_FIRED, FaultNeverFiredError

STOP_TIMEOUT_S = 10.0
"""Time the child has to leave after SIGTERM."""


@contextmanager
def serve_in_process(
    *,
    firmware: str,
    hand: Literal["right", "left"],
    unit: str,
    seed: int,
    program: Path | None = None,
    faults: Sequence[Fault] = (),
) -> Iterator[str]:
    """Start an emulated hand on a pseudo-terminal and yield the path a client may open.

    Raises:
        FaultNeverFiredError: a fault had no effect until it was stopped.
        RuntimeError: it did not start, or did not stop cleanly; the message carries what it printed.
    """
    command = [sys.executable, "-P", "-m", "hil.cli", "emulate", "--firmware", firmware, "--hand", hand]
    command += ["--unit", unit, "--seed", str(seed), "--parent", str(os.getpid())]
    if program is not None:
        command += ["--firmware-program", str(program)]
    for fault in faults:
        command += ["--fault", str(fault)]
    pipe = subprocess.PIPE
    # In a session of its own, so that Ctrl-C in a terminal reaches only this program, which opens the hand first.
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, start_new_session=True) as child:
        assert child.stdout is not None
        ready = child.stdout.readline().split(maxsplit=1)
        if len(ready) != 2 or ready[0] != "ready":
            child.kill()
            raise RuntimeError(f"`aero-hil emulate` did not start: {child.communicate()[1].strip()}")
        try:
            yield ready[1].strip()
        finally:
            child.terminate()
            try:
                _, errors = child.communicate(timeout=STOP_TIMEOUT_S)
            except subprocess.TimeoutExpired:
                child.kill()
                raise RuntimeError(f"`aero-hil emulate` did not stop within {STOP_TIMEOUT_S:g} s") from None
        if NEVER_FIRED in errors:
            raise FaultNeverFiredError(errors.strip().removeprefix("Error: "))
        if child.returncode:
            raise RuntimeError(f"`aero-hil emulate` ended with status {child.returncode}: {errors.strip()}")
