"""Child process with line-wise output in reader threads and a time-out on every wait."""

from __future__ import annotations

import logging
import os
import signal
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

from aero.clock import Deadline, WallClock

_LOG = logging.getLogger(__name__)
READY = "ready"
"""First word of the line that a child prints once it is ready for use."""
KILL_S = 5.0
"""Time-out for a killed child to end, s."""
LEAVE_S = 0.5
"""Time for the last output of an ended child to arrive, and for its own children to end, s."""
POLL_S = 0.05
"""Period of checks that the child still runs, s."""
LONGEST_LINE = 2**20
LONGEST_ERROR_LINE = 4096
"""Lengths above which a line is delivered in parts, bytes."""
ERROR_LINES = 200
"""Number of last lines of a child's standard error that are stored."""


class ChildError(RuntimeError):
    """A child did not start, answer or end in time; the message has the child's name and standard error."""


class ChildTimeoutError(ChildError):
    """A child still runs, but did not start, answer or end in time."""


PACKAGES = ("aero", "serial", "numpy")
"""Packages whose folders precede all others but the standard library on a child's search path."""
_WALL = WallClock()
_ALL: weakref.WeakSet[ChildProcess] = weakref.WeakSet()


class ChildProcess:
    """Program in its own session, so that Ctrl-C in a terminal reaches only its parent.

    A wait that times out or is interrupted kills the child. Its own children, which may hold its pipes, end with it. A
    forked copy of this program closes the pipes, and ends nothing.
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
        self._killed = False
        pipe = subprocess.PIPE
        # Unbuffered, because buffers have locks: a fork during a read would leave a lock held for ever in the child.
        self._process = subprocess.Popen(
            command, stdin=pipe, stdout=pipe, stderr=pipe if own_errors else None, bufsize=0, start_new_session=True
        )
        readers = (self._read, self._read_errors) if own_errors else (self._read,)
        self.pid, self._owner = self._process.pid, os.getpid()
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

    def read_line(self, timeout_s: float, wanted: str = "answer", *, kills: bool = True) -> str:
        """Return the next output line.

        Args:
            timeout_s: time-out, s.
            wanted: verb of the error message.
            kills: whether a wait that times out or is interrupted kills the child.

        Raises:
            ChildTimeoutError: no line within `timeout_s`.
            ChildError: the child has ended.
        """
        try:
            line = self._next(timeout_s)
        except Empty:
            if kills:
                self.kill()
            said = f"{self._name} did not {wanted} within {timeout_s:g} s{self._printed()}"
            raise ChildTimeoutError(said) from None
        except BaseException:
            if kills:
                self.kill()
            raise
        if line is None:
            self.wait(LEAVE_S)  # it may have closed its output before
            self.kill()
            raise ChildError(f"{self._name} did not {wanted}{self._printed()}")
        return line

    def _next(self, timeout_s: float) -> str | None:
        """Return the next line, or None after the last one.

        Raises:
            Empty: no line within `timeout_s`.
        """
        deadline = Deadline.after(_WALL, timeout_s)
        while True:
            expired = deadline.expired
            with suppress(Empty):
                return self._lines.get(timeout=min(deadline.remaining, POLL_S))
            # The end of the output is no sign of the child's end, because its own children may hold the pipe.
            if not self.running:
                self.kill()
                return None if self._lines.empty() else self._lines.get()
            if expired:
                raise Empty

    def send(self, text: str) -> None:
        """Write to the child's standard input; blocks while the child does not read, until it is killed.

        Raises:
            BrokenPipeError: the child has ended.
            ValueError: its input was closed here.
        """
        assert self._process.stdin is not None
        left = memoryview(text.encode())
        while left:
            left = left[self._process.stdin.write(left) :]

    def dismiss(self, last_words: str) -> None:
        """Send `last_words` and close the child's input; the child continues without this program."""
        with suppress(BrokenPipeError, ValueError):  # ended, or closed before
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
            ChildTimeoutError: the child did not end in time.
        """
        if not self._ours:
            return 0
        try:
            if last_words is None:
                self._process.terminate()
            else:
                self.dismiss(last_words)
            if in_time := self.wait(timeout_s):
                self._join_readers(LEAVE_S)
        finally:
            self.kill()
        if not in_time:
            raise ChildTimeoutError(f"{self._name} did not stop within {timeout_s:g} s and was killed{self._printed()}")
        return self._process.returncode

    def kill(self) -> None:
        """Kill the child if it still runs and the processes that it started, and close its pipes."""
        if self._ours:
            self._kill_group()
            self.wait(KILL_S)
        self._close(self._process.stdin)
        self._join_readers(LEAVE_S)  # a process outside the child's group may hold a pipe
        for reader, pipe in zip_longest(self._readers, (self._process.stdout, self._process.stderr)):
            if reader is None or not reader.is_alive():
                self._close(pipe)

    @property
    def _ours(self) -> bool:
        """True in the program that started the child, False in a forked copy of it."""
        return self._owner == os.getpid()

    def _kill_group(self) -> None:
        if not hasattr(os, "killpg"):  # Windows
            self._process.kill()
        elif not self._killed:  # once, because the system may give the number of a vanished group to another
            self._killed = True
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.pid, signal.SIGKILL)

    def _join_readers(self, timeout_s: float) -> None:
        """Wait until all output is delivered, at most `timeout_s`."""
        deadline = Deadline.after(_WALL, timeout_s)
        for reader in self._readers:
            reader.join(deadline.remaining)

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
        for line in _lines_of(self._process.stdout, LONGEST_LINE):
            if line.partition(" ")[0] == READY:
                self._lines.put(line)
                continue
            self._deliver(self._on_line, line)
        self._lines.put(None)

    def _read_errors(self) -> None:
        for line in _lines_of(self._process.stderr, LONGEST_ERROR_LINE):
            self._errors.append(line)
            if self._on_error is not None:
                self._deliver(self._on_error, line)

    def _deliver(self, subscriber: Callable[[str], object], line: str) -> None:
        try:
            subscriber(line)
        except Exception:  # an error of a subscriber must not end the reader thread
            _LOG.exception("a line of %s is lost", self._name)


def _lines_of(pipe: IO[bytes] | None, longest: int) -> Iterator[str]:
    """Yield the lines of a pipe without their line ends, until its last writer has closed it.

    A line above `longest` bytes is yielded in parts.
    """
    assert pipe is not None
    rest = b""
    while some := os.read(pipe.fileno(), 65536):
        *lines, rest = (rest + some).split(b"\n")
        if len(rest) > longest:
            lines, rest = [*lines, rest], b""
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
