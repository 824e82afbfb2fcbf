"""`--view`: web page that shows a command's hand while it moves."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Protocol, runtime_checkable

from aero.child_process import ChildError
from hil.dialogue.asker import Asker
from hil.dialogue.printing import echo
from hil.targets.hand_spec import PortSpec
from hil.view.feed import Feed, Observer
from hil.view.frame import FaultOffered, Heading


@runtime_checkable
class AsksOnPage(Protocol):
    """Asker that also uses a page; a protocol, because that class loads the terminal's library."""

    page: Observer

    def hear(self, words: str, /) -> object:
        """Take an input of the user on the page."""


@contextmanager
def viewing(
    wanted: bool,
    spec: PortSpec,
    *,
    stay: bool = True,
    asks: bool = False,
    on_words: Callable[[str], object] | None = None,
    faults: Sequence[FaultOffered] = (),
    title: str = "",
) -> Iterator[Observer]:
    """Serve a page for the duration of a command if `wanted`, and print its address on standard error.

    Wrap all use of the hand: on exit this waits for the browser page, after the hand is closed.

    Args:
        wanted: True if `--view` was given.
        spec: the command's hand.
        stay: True to serve the page after the command until the browser closes it; in a terminal also until a first
            browser has opened it, or Ctrl-C.
        asks: True if `on_words` accepts answers of the user and Stop, False if it accepts acts.
        on_words: called in another thread with the user's input on the page; None for a page without input.
        faults: faults that the page offers to inject.
        title: title line of the page; empty for the description of the hand.
    """
    feed: Feed | None = None
    try:
        if wanted:
            acts = on_words is not None and not asks
            feed = Feed(
                Heading(title or spec.describe(), spec.side, live=True, hands_on=acts, asks=asks, faults=tuple(faults)),
                on_words,
            )
    except ChildError as error:
        echo(f"{error}; the hand runs without it", err=True)
    if feed is None:
        yield Observer()
        return
    echo(f"view {feed.url}", err=True)
    try:
        yield feed
    except BaseException:
        feed.abandon()
        raise
    if not stay:
        feed.abandon()
        return
    if in_terminal := sys.stderr.isatty():
        echo("the page stays until it is closed, or Ctrl-C", err=True)
    feed.end(stay=in_terminal)


@contextmanager
def asking(asker: Asker, hand: PortSpec, title: str = "") -> Iterator[Observer]:
    """Serve a page with questions during the block if the asker uses one; yield its observer."""
    on_page = asker if isinstance(asker, AsksOnPage) else None
    words = None if on_page is None else on_page.hear
    with viewing(on_page is not None, hand, asks=True, on_words=words, title=title) as page:
        if on_page is not None:
            on_page.page = page
        yield page


def telling(observer: Observer, progress: Callable[[float, str], Any]) -> Callable[[float, str], None]:
    """Return a progress callback that also notes each new action in the observer."""
    present = ""

    def tell(done: float, doing: str) -> None:
        nonlocal present
        progress(done, doing)
        if doing != present:
            present = doing
            observer.note(doing)

    return tell
