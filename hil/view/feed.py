"""Feed of the page: a thread that samples frames of the hand, and the process that shows them.

Only opening and ending the page block, with time-outs. Frames are dropped if the page is too slow.
"""

import json
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict
from queue import SimpleQueue

from aero.child_process import ChildError, ChildProcess
from hil.recordings.recording import Severity
from hil.view.frame import DO, CaseMessage, Heading, Message, Note, Verdicts, ViewEnd, line
from hil.view.sources import FRAMES_PER_S, Source

START_S = 60.0
"""Time-out of the page's start, s."""
SILENT_S = 15.0
"""Time-out of the page's heartbeat, s; its period is 1 s."""
SHARE = 0.05
"""Limit of the time fraction that sampling may take in the process that drives or emulates the hand."""
GIVE_WAY_S = 1.0
"""Pause of sampling after a delay of the board, s."""
STOP_S = 5.0
"""Time-out of the page's exit, s."""


class Observer:
    """Observer interface of a command; this base class ignores every call."""

    def follow(self, source: Source) -> None:
        """Show the hand of a source."""

    def note(self, text: str, severity: Severity = "info") -> None:
        """Show an event, at the time of the last frame."""

    def give_way(self) -> None:
        """Pause sampling for `GIVE_WAY_S` after a delay of the hand or its board."""

    def verdicts(self, passed: int, failed: Sequence[str]) -> None:
        """Show the findings so far: number of passed checks, and sentences on the failed ones."""

    def show(self, message: CaseMessage) -> None:
        """Show a message of a case to the person at the hand."""

    @property
    def sending(self) -> bool:
        """True if a page receives the frames."""
        return False


class Feed(Observer):
    """Observer with a page that shows a hand driven by this process."""

    def __init__(self, heading: Heading, on_words: Callable[[str], object] | None = None) -> None:
        """Start the page's process and wait until the page can be opened.

        Args:
            heading: title and features of the page.
            on_words: called in a separate thread with each user command on the page.

        Raises:
            ChildError: the page did not start; its process printed the cause on standard error.
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
            """Address of the page."""
            self._messages: SimpleQueue[Message] = SimpleQueue()
            self._source: Source | None = None
            self._ended = threading.Event()
            self._time = 0.0
            self._pause_s = 1.0 / FRAMES_PER_S
            """Time to the next frame, s."""
            self._late_s = 0.0
            self._thread = threading.Thread(target=self._run, name="view", daemon=True)
            self._thread.start()
        except BaseException:  # without its feed, the page's process would never exit
            self._page.kill()
            raise

    @property
    def pid(self) -> int:
        """Process ID of the page."""
        return self._page.pid

    @property
    def sending(self) -> bool:
        """True if frames are sent to the page."""
        return self._thread.is_alive()

    def give_way(self) -> None:
        """Pause sampling for `GIVE_WAY_S` after a delay of the hand or its board."""
        self._late_s = GIVE_WAY_S

    def follow(self, source: Source) -> None:
        """Show the hand of a source."""
        self._source = source

    def note(self, text: str, severity: Severity = "info") -> None:
        """Show an event, at the time of the last frame."""
        self._messages.put(Note(self._time, text, severity))

    def verdicts(self, passed: int, failed: Sequence[str]) -> None:
        """Show the findings so far: number of passed checks, and sentences on the failed ones."""
        self._messages.put(Verdicts(passed, tuple(failed)))

    def show(self, message: CaseMessage) -> None:
        """Show a message of a case to the person at the hand."""
        self._messages.put(message)

    def end(self, *, stay: bool) -> None:
        """Stop sampling and wait until the last browser has closed the page, or for Ctrl-C.

        Args:
            stay: True to wait for a first browser too.
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
        """Sample and send frames until the end; a failure of the page is reported once and stops only the feed."""
        try:
            while not self._ended.wait(self._pause_s):
                begin = time.monotonic()
                self._send()
                # Adapt the rate, because on a busy computer sampling competes with the hand for a core.
                self._pause_s = max(1.0 / FRAMES_PER_S, (time.monotonic() - begin) / SHARE, self._late_s)
                self._late_s = 0.0
            self._send()
        except Exception as error:  # a failed observer must not stop the hand
            if not self._ended.is_set():
                print(f"the page has ended ({error}); the hand continues", file=sys.stderr)
            self._page.kill()

    def _send(self) -> None:
        frame = None if self._source is None else self._source.frame()
        lines = []
        if frame is not None and frame.t != self._time:
            self._time = frame.t
            lines.append(line(frame))
        while not self._messages.empty():  # this thread is the only consumer
            lines.append(line(self._messages.get()))
        if lines:
            self._page.send("".join(lines))
