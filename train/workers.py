"""Worker processes that end with the program, and distribution of work to them."""

import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor, as_completed
from contextlib import AbstractContextManager, contextmanager
from multiprocessing import active_children, get_context, parent_process
from multiprocessing.connection import wait
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")
ATTEMPTS = 3
"""Limit of worker deaths in a row without a finished trial; at it the work is aborted."""


def usable_cores() -> int:
    """Return the number of cores available to this process."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def worker_processes(count: int) -> Iterator[Executor]:
    """Yield an executor over fresh processes, because MuJoCo does not survive a fork.

    Leaving the block kills the workers at once, even busy ones, so that Ctrl-C does not wait for discarded results.
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
    """Ignore Ctrl-C, which the parent process handles, and end with the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_the_parent()


def end_with_the_parent() -> None:
    """Exit this worker as soon as its parent process has ended.

    A worker waits on a pipe whose write end it keeps open too, so it would never notice that the parent was killed or
    interrupted twice.
    """
    if (parent := parent_process()) is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)


def conduct(
    items: Sequence[Item],
    work: Callable[[Item], Result],
    executor: Callable[[], AbstractContextManager[Executor]],
    on_result: Callable[[Result], None],
) -> None:
    """Run `work` on each item; call `on_result` with each result at once.

    Items of a dead worker are repeated by the next workers.

    Args:
        items: arguments of the work.
        work: function that can be pickled; its exceptions abort the call.
        executor: factory of a context manager that yields workers; called again after the workers have died.
        on_result: called in this process, once for each item.

    Raises:
        RuntimeError: the workers died `ATTEMPTS` times in a row.
    """
    left, attempts = dict(enumerate(items)), 0
    while left:
        before = len(left)
        try:
            with executor() as workers:
                futures = {workers.submit(work, item): number for number, item in left.items()}
                for future in as_completed(futures):
                    on_result(future.result())
                    del left[futures[future]]
        except BrokenExecutor as error:
            attempts = attempts + 1 if len(left) == before else 0
            if attempts == ATTEMPTS:
                raise RuntimeError(f"the workers died {ATTEMPTS} times over {next(iter(left.values()))}") from error
