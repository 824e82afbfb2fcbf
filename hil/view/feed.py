"""The hand's end of the page: a thread that takes frames of the hand, and a process that shows them.

Nothing here waits for the page, but opening and ending it, which have time limits. A frame that the page has no time
for is not taken.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict
from queue import SimpleQueue

from aero.child_process import ChildError, ChildProcess
from hil.view.frame import DO, CaseMessage, Heading, Message, Note, Severity, Verdicts, ViewEnd, line
from hil.view.sources import FRAMES_PER_S, Source

START_S = 60.0
"""Time in which the page has to be there, s."""
SILENT_S = 15.0
"""Time without a sign of life after which the page is not waited for, s; it gives one a second."""
SHARE = 0.05
"""Largest part of the time that frames may take of the process that drives or emulates the hand."""
GIVE_WAY_S = 1.0
"""Pause after a board was late, s."""
STOP_S = 5.0
"""Time that the page has to end, s."""


class Observer:
    """What a command tells whoever looks on: nobody."""

    def follow(self, source: Source) -> None:
        """Show this hand from now on."""

    def note(self, text: str, severity: Severity = "info") -> None:
        """Show an event, at the time of the last frame."""

    def give_way(self) -> None:
        """Take no frame for a while, because the hand or its board is late."""

    def verdicts(self, passed: int, failed: Sequence[str]) -> None:
        """Show what was found so far: checks within their limits, and a sentence for each that is not."""

    def show(self, message: CaseMessage) -> None:
        """Show the person at the hand something of a case."""

    @property
    def sending(self) -> bool:
        """Whether anybody can look on."""
        return False


class Feed(Observer):
    """A page that shows a hand which this process drives."""

    def __init__(self, heading: Heading, on_words: Callable[[str], object] | None = None) -> None:
        """Start the page's process and wait until the page can be opened.

        Args:
            heading: of the page.
            on_words: called in a thread of its own with what a person does to the hand on the page.

        Raises:
            ChildError: it did not start; it has said why on standard error.
        """
        self._alive = threading.Event()
        self._on_words = on_words
        self._page = ChildProcess(
            [sys.executable, "-P", "-m", "hil.view"], "the page", on_line=self._heard, own_errors=False
        )
        try:
            with suppress(BrokenPipeError):
                self._page.send(json.dumps(asdict(heading)) + "\n")
            self.url = self._page.wait_ready(START_S)
            """What to open in a browser."""
            self._messages: SimpleQueue[Message] = SimpleQueue()
            self._source: Source | None = None
            self._ended = threading.Event()
            self._time = 0.0
            self._pause_s = 1.0 / FRAMES_PER_S
            """Time to the next frame, s."""
            self._late_s = 0.0
            self._thread = threading.Thread(target=self._run, name="view", daemon=True)
            self._thread.start()
        except BaseException:  # a page without its feed would stay
            self._page.kill()
            raise

    @property
    def pid(self) -> int:
        """Number of the page's process."""
        return self._page.pid

    @property
    def sending(self) -> bool:
        """Whether frames go to the page."""
        return self._thread.is_alive()

    def give_way(self) -> None:
        """Take no frame for a while, because the hand or its board is late."""
        self._late_s = GIVE_WAY_S

    def follow(self, source: Source) -> None:
        """Show this hand from now on."""
        self._source = source

    def note(self, text: str, severity: Severity = "info") -> None:
        """Show an event, at the time of the last frame."""
        self._messages.put(Note(self._time, text, severity))

    def verdicts(self, passed: int, failed: Sequence[str]) -> None:
        """Show what was found so far: checks within their limits, and a sentence for each that is not."""
        self._messages.put(Verdicts(passed, tuple(failed)))

    def show(self, message: CaseMessage) -> None:
        """Show the person at the hand something of a case."""
        self._messages.put(message)

    def end(self, *, stay: bool) -> None:
        """Say that the hand is done, and return when the page is not needed any more.

        That is at once when no browser has it open, otherwise when the last one has gone, or at Ctrl-C.

        Args:
            stay: wait for a first browser too.
        """
        self._messages.put(ViewEnd(stay))
        self._ended.set()
        with suppress(KeyboardInterrupt):
            while not self._page.wait(SILENT_S) and self._alive.is_set():
                self._alive.clear()
        self.abandon()

    def abandon(self) -> None:
        """End the page at once."""
        self._ended.set()
        with suppress(ChildError):
            self._page.end(STOP_S)
        self._thread.join()

    def _heard(self, said: str) -> None:
        self._alive.set()
        word, _, words = said.partition(" ")
        if word == DO and self._on_words is not None:
            self._on_words(json.loads(words))

    def _run(self) -> None:
        """Take frames and send them until the end; a page that has gone is said once and changes nothing else."""
        try:
            while not self._ended.wait(self._pause_s):
                begin = time.monotonic()
                self._send()
                # On a busy computer a frame takes long, and the hand is waiting for the same core.
                self._pause_s = max(1.0 / FRAMES_PER_S, (time.monotonic() - begin) / SHARE, self._late_s)
                self._late_s = 0.0
            self._send()
        except Exception as error:  # who watches does not end what is watched
            if not self._ended.is_set():
                print(f"the page has ended ({error}); the hand continues", file=sys.stderr)
            self._page.kill()

    def _send(self) -> None:
        frame = None if self._source is None else self._source.frame()
        lines = []
        if frame is not None and frame.t != self._time:
            self._time = frame.t
            lines.append(line(frame))
        while not self._messages.empty():  # no other thread takes from it
            lines.append(line(self._messages.get()))
        if lines:
            self._page.send("".join(lines))
