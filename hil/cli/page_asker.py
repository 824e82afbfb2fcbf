"""The person at the hand, reached by the terminal and by the page at once; the first answer counts."""

from __future__ import annotations

import _thread
import os
import select
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING

import click

from aero.clock import Clock
from hil.cli.terminal_asker import TerminalAsker
from hil.cli.viewing import viewing
from hil.targets.asker import Answer, CaseShown, Choice, Motion, Question
from hil.targets.hand_spec import HandSpec
from hil.targets.target import Target
from hil.view.feed import Observer
from hil.view.frame import ANSWER, STOP, Asked, CaseStands, Moving, Told
from hil.view.sources import source_of

if TYPE_CHECKING:
    from rich.console import Console

    from hil.cli.case_session import CaseHand, CaseHelper

LOOK_S = 1.0
"""Period in which a page that has gone is noticed, s."""
POLL_S = 0.1
"""Period in which answers are looked for where no system call waits for them, s."""
try:
    import termios
except ImportError:  # Windows
    termios = None  # type: ignore[assignment]


class PageAsker(TerminalAsker):
    """Asks on the terminal and on the page, and shows both the same.

    On Windows, whose consoles cannot be waited for, the page alone answers.
    """

    def __init__(self, console: Console) -> None:
        """Print to a console; nobody looks at a page until `page` is set."""
        super().__init__(console)
        self.page = Observer()
        """Of whoever looks at the page."""
        self._number = 0
        self._answered: SimpleQueue[tuple[int, str]] = SimpleQueue()
        self._wakes, self._wake = os.pipe()
        self._reads = sys.stdin is not None and os.name == "posix"
        self._typed = b""
        self._stopped = False

    def hear(self, words: str) -> None:
        """Take words of the page, in any thread. Stop is Ctrl-C: the guard opens the hand, and the program ends."""
        kind, _, rest = words.partition(" ")
        if kind == STOP and not self._stopped:
            self._stopped = True
            if os.name == "posix":  # it wakes a main thread that waits
                signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
            else:
                _thread.interrupt_main()
        elif kind == ANSWER:
            number, _, line = rest.partition(" ")
            with suppress(ValueError):
                self._answered.put((int(number), line))
                os.write(self._wake, b".")

    def ask(self, question: Question[Answer]) -> Answer:
        """Ask until there is an answer that fits.

        Raises:
            KeyboardInterrupt: Stop, Ctrl-C, the end of a terminal's input, or of all input without a page.
        """
        self._number += 1
        labels = tuple(one.label for one in question.options) if isinstance(question, Choice) else ()
        self.page.show(Asked(self._number, question.text, labels))
        try:
            return super().ask(question)
        finally:
            self.page.show(Asked(0))

    def show(self, case: CaseShown) -> None:
        """Show how a case stands."""
        super().show(case)
        step = case.step
        if step is None:
            self.page.show(CaseStands(case.done, conclusion=case.conclusion))
        else:
            channels = tuple(map(int, step.channels))
            self.page.show(CaseStands(case.done, step.do, step.why, step.minutes, step.tool, channels))

    def announce(self, motion: Motion) -> None:
        """Show what will move before it does."""
        self.page.show(Moving(motion.text))
        super().announce(motion)

    def progress(self, part: float, doing: str, left_s: float) -> None:
        """Show how far the announced motion is."""
        self.page.show(Moving("", part, doing, left_s))
        super().progress(part, doing, left_s)

    def tell(self, text: str) -> None:
        """Show a line."""
        self.page.show(Told(text))
        super().tell(text)

    def read_line(self, legend: str) -> str:
        """Return what is typed or clicked first; what was half typed then is dropped."""
        click.echo(f"{legend}> ", nl=False)
        while True:
            with suppress(Empty):
                number, line = self._answered.get_nowait()
                if number == self._number:
                    self._drop_typed()
                    click.echo(f"{line} (on the page)")
                    return line
                continue  # of a question that was answered before
            if b"\n" in self._typed:
                typed, _, self._typed = self._typed.partition(b"\n")
                return typed.decode(errors="replace")
            if not self._reads and not self.page.sending:
                raise KeyboardInterrupt
            if os.name != "posix":
                time.sleep(POLL_S)
                continue
            ends = [self._wakes, *([sys.stdin.fileno()] if self._reads else [])]
            ready = select.select(ends, [], [], LOOK_S)[0]
            if self._wakes in ready:
                os.read(self._wakes, 1)
            elif ready:
                self._read()

    def _read(self) -> None:
        """Read what was typed; the end of a terminal's input stops, that of a script leaves the page."""
        end = sys.stdin.fileno()
        data = os.read(end, 4096)
        self._typed += data
        if not data:
            self._reads = False
            if os.isatty(end):
                raise KeyboardInterrupt

    def _drop_typed(self) -> None:
        """Drop what is in the terminal's line: it was meant for a question that is answered."""
        if self._reads and termios is not None and os.isatty(sys.stdin.fileno()):
            self._typed = b""
            termios.tcflush(sys.stdin.fileno(), termios.TCIFLUSH)


@dataclass(frozen=True)
class SeenHand:
    """The hand of a case, shown on the page whenever it is open."""

    hand: CaseHand
    page: Observer

    @property
    def spec(self) -> HandSpec:
        """Which one it is."""
        return self.hand.spec

    @property
    def clock(self) -> Clock:
        """Its time."""
        return self.hand.clock

    @property
    def helper(self) -> CaseHelper | None:
        """Who does the steps where a person asks for it."""
        return self.hand.helper

    @contextmanager
    def open(self) -> Iterator[Target]:
        """Open it."""
        with self.hand.open() as target:
            self.page.follow(source_of(target))
            yield target


@contextmanager
def asking(asker: TerminalAsker, hand: HandSpec) -> Iterator[Observer]:
    """Serve a page that asks for as long as the block runs, where the asker takes one, and yield who looks on."""
    wanted = isinstance(asker, PageAsker)
    with viewing(wanted, hand, asks=True, on_words=asker.hear if isinstance(asker, PageAsker) else None) as page:
        if isinstance(asker, PageAsker):
            asker.page = page
        yield page
