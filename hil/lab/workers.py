"""What worker processes do first, as initializers of their pools."""

from __future__ import annotations

import os
import signal
from multiprocessing import parent_process
from multiprocessing.connection import wait
from threading import Thread


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
        Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)
