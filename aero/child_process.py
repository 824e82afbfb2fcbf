"""A child process: what it prints is read as it comes, and no wait for it lasts for ever."""

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
"""First word of the line that a child prints when it can be used."""
KILL_S = 5.0
"""Time that a killed child has to go, and what reads its output to finish, s."""
ERROR_LINES = 200
"""Last lines of its standard error that are stored."""


class ChildError(RuntimeError):
    """A child did not start, did not answer or did not end; the message has its name and what it printed."""


PACKAGES = ("aero", "serial", "numpy")
"""Packages that a child process imports first."""
_ALL: weakref.WeakSet[ChildProcess] = weakref.WeakSet()


class ChildProcess:
    """A program in a session of its own, so that Ctrl-C in a terminal reaches its parent alone.

    A wait for it that fails, or that Ctrl-C interrupts, kills it. A process that this program forks lets go of it.
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
        """Start it.

        Args:
            command: program and arguments.
            name: what messages call it.
            on_line: called in another thread with each line that it prints, but for the one that says `ready`; without
                it, lines wait for `read_line`.
            on_error: called in another thread with each line of its standard error.
            own_errors: whether its standard error is taken for messages; it shares that of this program otherwise.
        """
        self._name = name
        self._lines: SimpleQueue[str | None] = SimpleQueue()
        """None when it prints no more."""
        self._on_line = on_line or self._lines.put
        self._errors: deque[str] = deque(maxlen=ERROR_LINES)
        self._on_error = on_error
        pipe = subprocess.PIPE
        # Without buffers, which have locks: a fork in the middle of a read would leave one locked in the child.
        self._process = subprocess.Popen(
            command, stdin=pipe, stdout=pipe, stderr=pipe if own_errors else None, bufsize=0, start_new_session=True
        )
        readers = (self._read, self._read_errors) if own_errors else (self._read,)
        self.pid = self._process.pid
        """Number of the process."""
        _ALL.add(self)
        self._readers: list[threading.Thread] = []
        try:
            for reader in readers:
                thread = threading.Thread(target=reader, daemon=True)
                thread.start()
                self._readers.append(thread)
        except BaseException:  # a child that nothing reads would wait for ever, and nobody refers to it
            self.kill()
            raise

    @property
    def running(self) -> bool:
        """Whether it has not ended."""
        return self._process.poll() is None

    @property
    def errors(self) -> str:
        """What it has printed on standard error."""
        return "\n".join(self._errors).strip()

    def wait_ready(self, timeout_s: float) -> str:
        """Return what it prints after `ready`.

        Raises:
            ChildError: it ends before, or is silent for `timeout_s`.
        """
        while True:
            word, _, rest = self.read_line(timeout_s, "start").partition(" ")
            if word == READY:
                return rest

    def read_line(self, timeout_s: float, wanted: str = "answer") -> str:
        """Return the next line that it prints; `wanted` is the verb that a message has for it.

        Raises:
            ChildError: it has ended, or prints none within `timeout_s`.
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
        """Write to its standard input; this waits while the child does not read, and ends when it is killed.

        Raises:
            BrokenPipeError: it has ended.
        """
        assert self._process.stdin is not None
        left = memoryview(text.encode())
        while left:
            left = left[self._process.stdin.write(left) :]

    def dismiss(self, last_words: str) -> None:
        """Say the last thing to it, and end its input; it continues without this program."""
        with suppress(BrokenPipeError):
            self.send(last_words)
        self._close(self._process.stdin)

    def wait(self, timeout_s: float) -> bool:
        """Return whether it ends by itself within `timeout_s`."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout_s)
        return not self.running

    def end(self, timeout_s: float, *, last_words: str | None = None) -> int:
        """Let it end within `timeout_s`, and return its exit status.

        Args:
            timeout_s: time that it has.
            last_words: sent before its input is closed; it is told to terminate when None.

        Raises:
            ChildError: it did not end in time.
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
        """End it at once, if it has not ended."""
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
        """Let go of its pipes after a fork, in the child: it is the parent's to end and to wait for."""
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
        except Exception:  # a subscriber does not stop the reading
            _LOG.exception("a line of %s is lost", self._name)


def _lines_of(pipe: IO[bytes] | None) -> Iterator[str]:
    """Yield the lines that come through a pipe, without their ends, until nobody can write to it any more."""
    assert pipe is not None
    rest = b""
    while some := os.read(pipe.fileno(), 65536):
        *lines, rest = (rest + some).split(b"\n")
        yield from (line.decode(errors="replace").rstrip("\r") for line in lines)
    if rest:
        yield rest.decode(errors="replace")


def python(code: str) -> list[str]:
    """Return the command that runs `code` in this Python, with its search path: a project need not be installed.

    The standard library and the folders of this program's packages come first. Otherwise a file such as `signal.py`
    or `serial.py` in the present folder, which `python -m` puts first, would take their place.
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
