"""Keeps the cores of a virtual machine awake while something runs in real time on it.

A virtual core that sleeps is the host's again, and a busy host may take longer to give it back than the driver waits
for a reply (figures in docs/validation.md).
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
    """Give each core of a virtual machine something to do; elsewhere do nothing."""
    if not (CPUINFO.exists() and is_virtual(CPUINFO.read_text())):
        yield
        return
    # Run by path and isolated, so that nothing of this project is imported. In a session of its own, so that Ctrl-C
    # reaches only the parent, whose end closes the pipe, and because Linux shares the cores out among sessions first.
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
    # At ordinary priority: beside processes of a low one (nice 10, 19, SCHED_IDLE) in its session, one that had work to
    # do was now and then left waiting for 0.3 to 7 s.
    while os.getppid() == keeper:
        for _ in range(TURNS):
            pass
    os._exit(0)  # nothing to tidy up


if __name__ == "__main__":
    _keep()
