"""Keeps the cores of a virtual machine awake while something runs in real time on it.

A virtual core that sleeps is the host's again, and a busy host may take long to give it back: with a hand on a
pseudo-terminal on two such cores, 28 of 2032 readings took over 0.1 s, the longest 0.8 s, which is more than the driver
waits; with a process of the lowest priority on each core, none of 26589 took over 0.06 s.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn

CPUINFO = Path("/proc/cpuinfo")
TURNS = 1000
"""Of the empty loop between two looks at whether the keeper still lives: some tens of microseconds."""


def is_virtual(cpuinfo: str) -> bool:
    """Return whether the text of `/proc/cpuinfo` is a virtual machine's, as x86 processors tell."""
    return any("hypervisor" in line.split() for line in cpuinfo.splitlines() if line.startswith("flags"))


@contextmanager
def cores_awake() -> Iterator[None]:
    """Give each core of a virtual machine something to do that yields to everything else; elsewhere do nothing."""
    if not (CPUINFO.exists() and is_virtual(CPUINFO.read_text())):
        yield
        return
    # Run by path and isolated, so that nothing of this project is imported; in a session of its own, so that Ctrl-C
    # reaches only the parent, whose end closes the pipe.
    command = [sys.executable, "-I", __file__]
    with subprocess.Popen(command, stdin=subprocess.PIPE, start_new_session=True):
        yield


def _keep() -> None:
    """Leave one process turning on each core until standard input is closed."""
    keeper = os.getpid()
    for core in os.sched_getaffinity(0):
        if not os.fork():
            _turn(core, keeper)
    sys.stdin.read()


def _turn(core: int, keeper: int) -> NoReturn:
    os.sched_setaffinity(0, {core})
    os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
    while os.getppid() == keeper:
        for _ in range(TURNS):
            pass
    os._exit(0)  # nothing to tidy up, and on a busy core little time to do it in


if __name__ == "__main__":
    _keep()
