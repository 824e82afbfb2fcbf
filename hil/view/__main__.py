"""The page's own process: reads frames as lines from its standard input and shows the newest.

Says `ready URL` when the page can be opened, and ends with its input, at the latest.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from queue import SimpleQueue

from hil.view.frame import Heading, Message, Note, Verdicts, ViewEnd, ViewFrame, message
from hil.view.web_page import Page, keep_up

POLITENESS = 10
"""How far the page steps back, on a busy machine, behind the program that drives the hand; the shell's `nice`."""
ALIVE = "alive"
"""Said once a second."""
RELOAD_S = 3.0
"""Time without any browser after which all have gone, and none is merely loading the page again, s."""


class PageSession:
    """One page and what comes for it."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self._came: SimpleQueue[Message | None] = SimpleQueue()
        """None at the end of the input."""
        self._end: ViewEnd | None = None
        self._closed = self._looked_at = False
        self._last_seen = self._said = time.monotonic()

    def read(self) -> None:
        """Take lines until there are no more; for a thread of its own."""
        for line in sys.stdin:
            self._came.put(message(line))
        self._came.put(None)

    def going_on(self) -> bool:
        """Show what has come and return whether the page is still of use."""
        while not self._came.empty():
            self._show(self._came.get())
        now = time.monotonic()
        if now - self._said > 1.0:
            self._said = now
            print(ALIVE, flush=True)
        if self._page.viewers:
            self._looked_at, self._last_seen = True, now
        if self._closed:
            return False
        if self._end is None or now - self._last_seen < RELOAD_S:
            return True
        return self._end.stay and not self._looked_at

    def _show(self, came: Message | None) -> None:
        match came:
            case ViewFrame():
                self._page.add([came])
            case Note():
                self._page.note(came)
            case Verdicts():
                self._page.verdicts(came)
            case ViewEnd():
                self._end = came
                self._page.end()
                # Without anybody who looks, and nobody to wait for, there is no reload to wait for either.
                if not self._page.viewers:
                    self._last_seen = time.monotonic() - RELOAD_S
            case None:
                self._closed = True


def main() -> None:
    """Serve the page that the first line of the input describes."""
    if hasattr(os, "nice"):
        os.nice(POLITENESS)
    page = Page(Heading(**json.loads(sys.stdin.readline())))
    print("ready", page.url, flush=True)
    session = PageSession(page)
    threading.Thread(target=session.read, daemon=True).start()
    keep_up(page, session.going_on)
    page.close()


if __name__ == "__main__":
    main()
