"""The page's own process: reads messages as lines from its standard input and shows them.

Says `ready URL` when the page can be opened, and ends with its input, at the latest.
"""

from __future__ import annotations

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
"""How far the page steps back, on a busy machine, behind the program that drives the hand; the shell's `nice`."""
ALIVE_S = 1.0
"""Time between signs of life, s."""
RELOAD_S = 3.0
"""Time without any browser after which all have gone, and none is merely loading the page again, s."""


_ONE_AT_A_TIME = threading.Lock()


def say(*words: str) -> None:
    """Print a line; sliders are heard in threads of viser's, and their lines must not run into each other."""
    with _ONE_AT_A_TIME:
        sys.stdout.write(" ".join(words) + "\n")
        sys.stdout.flush()


def serve(page: Page, received: SimpleQueue[Message | None]) -> None:
    """Show what is received, until None or until it has ended and nobody looks any more."""
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
    """Serve the page that the first line of the input describes."""
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
