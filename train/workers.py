"""Worker processes that compute for one program, and end with it."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process
from multiprocessing.connection import wait


def usable_cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def worker_processes(count: int) -> Iterator[Executor]:
    """Yield workers in fresh processes: MuJoCo does not survive a fork.

    Leaving the block ends them at once, whatever they are doing: after Ctrl-C nobody waits for what is thrown away.
    """
    others = set(active_children())
    executor = ProcessPoolExecutor(count, mp_context=get_context("spawn"), initializer=leave_interrupts_to_the_parent)
    try:
        yield executor
    finally:
        for worker in set(active_children()) - others:
            worker.kill()
        executor.shutdown(wait=True, cancel_futures=True)


def leave_interrupts_to_the_parent() -> None:
    """Ignore Ctrl-C, which the program that started this worker answers, and end with that program."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_the_parent()


def end_with_the_parent() -> None:
    """End this worker as soon as the program that started it has ended.

    A worker waits for work on a pipe that it holds open itself, so it would never learn that a killed program, or one
    that was interrupted twice, sends no more.
    """
    if (parent := parent_process()) is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)
