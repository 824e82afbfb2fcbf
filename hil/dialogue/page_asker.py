"""Questions to the user on terminal and page at once; the first answer counts."""

from __future__ import annotations

import _thread
import os
import signal
import threading
import time
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING

from hil.dialogue.asker import Answer, CaseShown, Choice, Motion, Question
from hil.dialogue.printing import echo
from hil.dialogue.terminal_asker import TerminalAsker
from hil.targets.target import Target
from hil.view.feed import Observer
from hil.view.frame import ANSWER, STOP, Asked, CaseStands, Moving, Told
from hil.view.sources import source_of

if TYPE_CHECKING:
    from rich.console import Console

POLL_S = 0.1
"""Poll period for answers on systems without `select` on consoles, s."""


class PageAsker(TerminalAsker):
    """Asker that uses the terminal and the page in parallel.

    On Windows, whose consoles cannot be polled, only the page accepts answers.
    """

    def __init__(self, console: Console) -> None:
        """Print to a console; `page` is initially an observer without a page."""
        super().__init__(console)
        self.page = Observer()
        """Observer behind the page."""
        self._number = 0
        self._answered: SimpleQueue[tuple[int, str]] = SimpleQueue()
        self._wakes, self._wake = os.pipe()
        self._stopped = False

    def hear(self, words: str) -> None:
        """Handle a message from the page, in any thread; Stop acts like Ctrl-C."""
        kind, _, rest = words.partition(" ")
        if kind == STOP and not self._stopped:
            self._stopped = True
            if os.name == "posix":  # wakes a waiting main thread
                signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
            else:
                _thread.interrupt_main()
        elif kind == ANSWER:
            number, _, line = rest.partition(" ")
            with suppress(ValueError):
                self._answered.put((int(number), line))
                os.write(self._wake, b".")

    def ask(self, question: Question[Answer]) -> Answer:
        """Ask until a valid answer arrives.

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
        """Show the state of a case."""
        super().show(case)
        step = case.step
        if step is None:
            self.page.show(CaseStands(case.done, conclusion=case.conclusion))
        else:
            channels = tuple(map(int, step.channels))
            self.page.show(CaseStands(case.done, step.do, step.why, step.minutes, step.tool, channels))

    def announce(self, motion: Motion) -> None:
        """Show a motion before it starts."""
        self.page.show(Moving(motion.text))
        super().announce(motion)

    def progress(self, part: float, doing: str, left_s: float) -> None:
        """Show the progress of the announced motion."""
        self.page.show(Moving("", part, doing, left_s))
        super().progress(part, doing, left_s)

    def tell(self, text: str) -> None:
        """Show a line."""
        self.page.show(Told(text))
        super().tell(text)

    def follow(self, target: Target) -> None:
        """Show an opened hand on the page."""
        self.page.follow(source_of(target))

    def read_line(self, legend: str) -> str:
        """Return the first typed or clicked line."""
        echo(f"{legend}> ", nl=False)
        while True:
            with suppress(Empty):
                number, line = self._answered.get_nowait()
                if number == self._number:
                    echo(f"{line} (on the page)")
                    return line
                continue  # answer to an earlier question
            if os.name != "posix":
                if not self.page.sending:
                    raise KeyboardInterrupt
                time.sleep(POLL_S)
                continue
            if (typed := self._typed.line(self._wakes)) is not None:
                return typed
            if self._typed.over and not self.page.sending:
                raise KeyboardInterrupt
