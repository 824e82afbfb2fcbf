"""Process of the page: reads messages, one a line, from its standard input and shows them.

Prints `ready URL` once the page can be opened, and exits at the end of its input at the latest.
"""

import json
import math
import os
import sys
import threading
import time
from queue import SimpleQueue

from hil.view.frame import DO, Heading, Message, ViewEnd, message
from hil.view.web_page import Page

POLITENESS = 19
"""Nice value of the page's process, below the priority of the program that drives the hand."""
ALIVE_S = 1.0
"""Heartbeat period, s."""
RELOAD_S = 3.0
"""Threshold of time without a browser, s; above it the page counts as closed, not as reloading."""


_ONE_AT_A_TIME = threading.Lock()


def say(*words: str) -> None:
    """Print a line under a lock, because viser calls slider handlers in several threads."""
    with _ONE_AT_A_TIME:
        sys.stdout.write(" ".join(words) + "\n")
        sys.stdout.flush()


def serve(page: Page, received: SimpleQueue[Message | None]) -> None:
    """Show the received messages until None, or until the view has ended and no browser is connected."""
    end: ViewEnd | None = None
    looked_at, last_seen, alive = False, -math.inf, -math.inf
    while True:
        while not received.empty():
            new = received.get()
            if new is None:
                return
            page.show(new)
            if isinstance(new, ViewEnd):
                end = new
        now = time.monotonic()
        if now - alive > ALIVE_S:
            alive = now
            say("alive")
        if page.viewers:
            looked_at, last_seen = True, now
        if end is not None and now - last_seen > RELOAD_S and (looked_at or not end.stay):
            return
        page.tick()


def main() -> None:
    """Serve the page described by the first line of the input."""
    if hasattr(os, "nice"):
        os.nice(POLITENESS)
    page = Page(Heading(**json.loads(sys.stdin.readline())), on_words=lambda words: say(DO, json.dumps(words)))
    say("ready", page.url)
    received: SimpleQueue[Message | None] = SimpleQueue()

    def read() -> None:
        for line in sys.stdin:
            received.put(message(line))
        received.put(None)

    threading.Thread(target=read, daemon=True).start()
    serve(page, received)
    page.close()


if __name__ == "__main__":
    main()
