"""The hand's end of the page: a thread that looks at the hand now and then, and a process that shows what it saw.

Nothing here waits for the page, but opening and ending it. A frame that the page has no time for is not taken.
"""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict
from queue import Empty, SimpleQueue
from typing import IO

from hil.view.frame import Heading, Message, Note, Severity, Verdicts, ViewEnd
from hil.view.sources import Source

LOOKS_PER_S = 30.0
"""Looks a second of real time, whatever the hand's own clock does."""


class Feed:
    """A page that shows a hand which this process drives."""

    def __init__(self, heading: Heading) -> None:
        """Start the page's process and wait until the page can be opened.

        Raises:
            RuntimeError: it did not start; it has said why on standard error.
        """
        # In a session of its own, so that Ctrl-C in a terminal ends the hand's program and not what it is seen by.
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "hil.view"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._lines: IO[str] = self._process.stdin
        try:
            print(json.dumps(asdict(heading)), file=self._lines, flush=True)
            said = self._process.stdout.readline().split()
        except BrokenPipeError:
            said = []
        if len(said) != 2 or said[0] != "ready":
            self._process.kill()
            self._process.wait()
            raise RuntimeError("the page's process did not start; what it said is above")
        self.url = said[1]
        """What to open in a browser."""
        self._messages: SimpleQueue[Message] = SimpleQueue()
        self._source: Source | None = None
        self._ended = threading.Event()
        self._time = 0.0
        self._thread = threading.Thread(target=self._look, name="view", daemon=True)
        self._thread.start()

    def follow(self, source: Source) -> None:
        """Show this hand from now on."""
        self._source = source

    def note(self, text: str, severity: Severity = "info") -> None:
        """Show an event, at the time of the last look."""
        self._messages.put(Note(self._time, text, severity))

    def verdicts(self, passed: int, failed: Sequence[str]) -> None:
        """Show what was found so far: checks within their limits, and a sentence for each that is not."""
        self._messages.put(Verdicts(passed, tuple(failed)))

    def end(self, *, stay: bool) -> None:
        """Say that the hand is done, and return when the page is not needed any more.

        That is at once when no browser looks at it, otherwise when the last one has gone, or at Ctrl-C.

        Args:
            stay: wait for a first browser too.
        """
        self._messages.put(ViewEnd(stay))
        self._ended.set()
        try:
            self._process.wait()
        except KeyboardInterrupt:
            pass
        finally:
            self._stop()

    def abandon(self) -> None:
        """End the page at once."""
        self._ended.set()
        self._stop()

    def _stop(self) -> None:
        self._process.terminate()
        self._process.wait()
        self._thread.join()
        assert self._process.stdout is not None
        self._process.stdout.close()
        with suppress(BrokenPipeError):
            self._lines.close()

    def _look(self) -> None:
        """Look and tell, until the end; a page that has gone is said once and changes nothing else."""
        try:
            while not self._ended.wait(1.0 / LOOKS_PER_S):
                self._tell()
            self._tell()
        except BrokenPipeError:
            if not self._ended.is_set():
                print("the page's process has ended; the hand goes on", file=sys.stderr)
        except BaseException:
            self._process.terminate()  # it would be waited for, and nothing more comes
            raise

    def _tell(self) -> None:
        frame = None if self._source is None else self._source.frame()
        if frame is not None and frame.t != self._time:
            self._time = frame.t
            self._write(frame)
        while True:
            try:
                self._write(self._messages.get_nowait())
            except Empty:
                break
        self._lines.flush()

    def _write(self, what: Message) -> None:
        self._lines.write(what.line())
