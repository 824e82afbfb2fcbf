"""Child process with line-wise output in reader threads and a time-out on every wait."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
import sysconfig
import threading
import weakref
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from itertools import zip_longest
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import IO

_LOG = logging.getLogger(__name__)
READY = "ready"
"""First word of the line that a child prints once it is ready for use."""
KILL_S = 5.0
"""Time-out for a killed child and for each of its reader threads to end, s."""
ERROR_LINES = 200
"""Number of last lines of a child's standard error that are stored."""


class ChildError(RuntimeError):
    """A child did not start, answer or end in time; the message has the child's name and standard error."""


PACKAGES = ("aero", "serial", "numpy")
"""Packages whose folders precede all others but the standard library on a child's search path."""
_ALL: weakref.WeakSet[ChildProcess] = weakref.WeakSet()


class ChildProcess:
    """Program in its own session, so that Ctrl-C in a terminal reaches only its parent.

    A wait that times out or is interrupted kills the child. A forked copy of this program closes its pipes.
    """

    def __init__(
        self,
        command: Sequence[str],
        name: str,
        *,
        on_line: Callable[[str], object] | None = None,
        on_error: Callable[[str], object] | None = None,
        own_errors: bool = True,
    ) -> None:
        """Start the child.

        Args:
            command: program and arguments.
            name: name of the child in messages.
            on_line: called in a reader thread with each output line except the `ready` line; None queues the lines for
                `read_line`.
            on_error: called in a reader thread with each line of standard error.
            own_errors: whether to capture standard error for messages; False inherits this program's.
        """
        self._name = name
        self._lines: SimpleQueue[str | None] = SimpleQueue()
        """Lines for `read_line`; None marks the end of the output."""
        self._on_line = on_line or self._lines.put
        self._errors: deque[str] = deque(maxlen=ERROR_LINES)
        self._on_error = on_error
        pipe = subprocess.PIPE
        # Unbuffered, because buffers have locks: a fork during a read would leave a lock held for ever in the child.
        self._process = subprocess.Popen(
            command, stdin=pipe, stdout=pipe, stderr=pipe if own_errors else None, bufsize=0, start_new_session=True
        )
        readers = (self._read, self._read_errors) if own_errors else (self._read,)
        self.pid = self._process.pid
        _ALL.add(self)
        self._readers: list[threading.Thread] = []
        try:
            for reader in readers:
                thread = threading.Thread(target=reader, daemon=True)
                thread.start()
                self._readers.append(thread)
        except BaseException:  # without readers the child blocks for ever, and the caller has no reference to kill it
            self.kill()
            raise

    @property
    def running(self) -> bool:
        """True until the process has ended."""
        return self._process.poll() is None

    @property
    def errors(self) -> str:
        """Last lines of the child's standard error."""
        return "\n".join(self._errors).strip()

    def wait_ready(self, timeout_s: float) -> str:
        """Wait for the `ready` line and return its text after that word.

        Raises:
            ChildError: the child ends first, or prints nothing for `timeout_s`.
        """
        while True:
            word, _, rest = self.read_line(timeout_s, "start").partition(" ")
            if word == READY:
                return rest

    def read_line(self, timeout_s: float, wanted: str = "answer") -> str:
        """Return the next output line; `wanted` is the verb of the error message.

        Raises:
            ChildError: the child has ended, or prints no line within `timeout_s`.
        """
        try:
            line = self._lines.get(timeout=timeout_s)
        except Empty:
            self.kill()
            raise ChildError(f"{self._name} did not {wanted} within {timeout_s:g} s{self._printed()}") from None
        except BaseException:
            self.kill()
            raise
        if line is None:
            self.kill()
            raise ChildError(f"{self._name} did not {wanted}{self._printed()}")
        return line

    def send(self, text: str) -> None:
        """Write to the child's standard input; blocks while the child does not read, until it is killed.

        Raises:
            BrokenPipeError: the child has ended.
        """
        assert self._process.stdin is not None
        left = memoryview(text.encode())
        while left:
            left = left[self._process.stdin.write(left) :]

    def dismiss(self, last_words: str) -> None:
        """Send `last_words` and close the child's input; the child continues without this program."""
        with suppress(BrokenPipeError):
            self.send(last_words)
        self._close(self._process.stdin)

    def wait(self, timeout_s: float) -> bool:
        """Return whether the child ends by itself within `timeout_s`."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout_s)
        return not self.running

    def end(self, timeout_s: float, *, last_words: str | None = None) -> int:
        """End the child within `timeout_s` and return its exit status.

        Args:
            timeout_s: time-out, s; afterwards the child is killed.
            last_words: sent before the input is closed; None terminates the child by a signal.

        Raises:
            ChildError: the child did not end in time.
        """
        try:
            if last_words is None:
                self._process.terminate()
            else:
                self.dismiss(last_words)
            in_time = self.wait(timeout_s)
        finally:
            self.kill()
        if not in_time:
            raise ChildError(f"{self._name} did not stop within {timeout_s:g} s and was killed{self._printed()}")
        return self._process.returncode

    def kill(self) -> None:
        """Kill the child if it still runs, and close its pipes."""
        if self.running:
            self._process.kill()
        self.wait(KILL_S)
        self._close(self._process.stdin)
        for reader, pipe in zip_longest(self._readers, (self._process.stdout, self._process.stderr)):
            if reader is not None:
                reader.join(KILL_S)
            if reader is None or not reader.is_alive():  # a grandchild may hold the pipe's other end
                self._close(pipe)

    def _disown(self) -> None:
        """Close the pipes in a forked copy of this program; only the original ends and waits for the child."""
        for pipe in (self._process.stdin, self._process.stdout, self._process.stderr):
            self._close(pipe)
        self._process.returncode = 0

    @staticmethod
    def _close(pipe: IO[bytes] | None) -> None:
        if pipe is not None:
            pipe.close()

    def _printed(self) -> str:
        return f": {self.errors}" if self.errors else ""

    def _read(self) -> None:
        for line in _lines_of(self._process.stdout):
            if line.partition(" ")[0] == READY:
                self._lines.put(line)
                continue
            self._deliver(self._on_line, line)
        self._lines.put(None)

    def _read_errors(self) -> None:
        for line in _lines_of(self._process.stderr):
            self._errors.append(line)
            if self._on_error is not None:
                self._deliver(self._on_error, line)

    def _deliver(self, subscriber: Callable[[str], object], line: str) -> None:
        try:
            subscriber(line)
        except Exception:  # an error of a subscriber must not end the reader thread
            _LOG.exception("a line of %s is lost", self._name)


def _lines_of(pipe: IO[bytes] | None) -> Iterator[str]:
    """Yield the lines of a pipe without their line ends, until its last writer has closed it."""
    assert pipe is not None
    rest = b""
    while some := os.read(pipe.fileno(), 65536):
        *lines, rest = (rest + some).split(b"\n")
        yield from (line.decode(errors="replace").rstrip("\r") for line in lines)
    if rest:
        yield rest.decode(errors="replace")


def python(code: str) -> list[str]:
    """Return the command line that runs `code` in this Python with this process's search path.

    The standard library and the folders of `PACKAGES` precede the rest of the path. Otherwise `signal.py` or
    `serial.py` in the current folder, which `python -m` searches first, would shadow them.
    """
    library = tuple(sysconfig.get_path(name) for name in ("stdlib", "platstdlib"))
    ours = {str(Path(str(sys.modules[name].__file__)).parents[1]) for name in PACKAGES if name in sys.modules}

    def place(entry: str) -> int:
        in_library = entry.startswith(library) and "-packages" not in entry
        return 0 if in_library else 1 if entry in ours else 2

    path = sorted((str(Path(entry).absolute()) for entry in sys.path), key=place)
    return [sys.executable, "-P", "-c", f"import sys; sys.path[:] = {path!r}; {code}"]


def _disown_all() -> None:
    for process in list(_ALL):
        process._disown()


if hasattr(os, "register_at_fork"):  # Windows has no fork
    os.register_at_fork(after_in_child=_disown_all)
