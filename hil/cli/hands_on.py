"""What a person does to a hand that is served: words of the prompt and the page, done in the thread that serves it."""

from __future__ import annotations

import math
import os
import select
import stat
import sys
from collections.abc import Callable
from queue import SimpleQueue
from typing import Literal

from aero.channels import Channel
from aero.protocol import MAX_CODE, make_positions
from firmware_emulator.links.in_process import WireEntry
from hil.faults.acts import ACTS, act
from hil.faults.catalogue import channel_named
from hil.faults.workbench import Workbench

COMMAND = "command"
"""Begins the words that move a channel as a host would: `command ring 40`, in per cent of its window."""
IDLE_S = 2.0
"""Time without a byte of a program after which the page may command the hand, s."""
LARGEST = 4096


class HandsOn:
    """Takes lines from anywhere, and does what they say when `serve` is called."""

    def __init__(
        self, workbench: Workbench, tell: Callable[[str, Literal["info", "error"]], None], *, reads: bool = False
    ) -> None:
        """Prepare; `tell` is given what was done, or why it was not.

        With `reads`, lines of the standard input are taken too, where that is a terminal or a pipe.
        """
        self._workbench, self._tell = workbench, tell
        self._lines: SimpleQueue[str] = SimpleQueue()
        self._codes = [0] * len(Channel)
        self._heard = -math.inf
        self._told = 0
        self._typed = b""
        self._reads = reads and sys.stdin is not None and _can_be_read(sys.stdin.fileno())

    def put(self, line: str) -> None:
        """Take a line, from any thread."""
        self._lines.put(line)

    def heard(self, entry: WireEntry) -> None:
        """Note that a program holds the port."""
        if entry[1] == ">":
            self._heard = entry[0]

    def serve(self) -> None:
        """Do what was typed or clicked since the last call, and tell what has ended meanwhile."""
        self._read()
        while not self._lines.empty():
            if line := self._lines.get().strip():
                try:
                    self._do(line)
                except ValueError as error:
                    self._tell(str(error), "error")
        for _, text in self._workbench.done[self._told :]:
            self._tell(text, "info")
        self._told = len(self._workbench.done)

    def _do(self, line: str) -> None:
        words = line.split()
        if words[0] == "help":
            for name, one in ACTS.items():
                self._tell(f"{' '.join((name, *one.takes))}: {one.words}", "info")
        elif words[0] == COMMAND:
            self._command(*words[1:])
        else:
            act(self._workbench, line)

    def _command(self, label: str = "", percent: str = "") -> None:
        hand = self._workbench.hand
        if hand.kernel.now - self._heard < IDLE_S:
            raise ValueError("a program commands the hand; the page may when it has been silent for 2 s")
        channel = channel_named(label)
        try:
            self._codes[channel] = round(min(max(float(percent) / 100.0, 0.0), 1.0) * MAX_CODE)
        except ValueError:
            raise ValueError(f"it is written {COMMAND} CHANNEL PERCENT, not {label} {percent}") from None
        hand.receive(make_positions(self._codes))

    def _read(self) -> None:
        """Take what was typed; a process in the background that read its terminal would be stopped."""
        if not self._reads:
            return
        end = sys.stdin.fileno()
        if os.isatty(end) and os.tcgetpgrp(end) != os.getpgrp():
            return
        if not select.select([end], [], [], 0.0)[0]:
            return
        data = os.read(end, LARGEST)
        self._reads = bool(data)
        *lines, self._typed = (self._typed + data).split(b"\n")
        for line in lines:
            self.put(line.decode(errors="replace"))


def _can_be_read(end: int) -> bool:
    return os.isatty(end) or stat.S_ISFIFO(os.fstat(end).st_mode)
