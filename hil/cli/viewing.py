"""`--view`: a page that shows the hand of a command while it moves."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Protocol

import click

from aero.exit_code import Exit
from hil.cli.exits import Ended
from hil.cli.output import echo

if TYPE_CHECKING:
    from hil.targets.hand_spec import HandSpec
    from hil.view.frame import Severity
    from hil.view.sources import Source

NEEDS = "`--view` needs the extra `view`; from a checkout: pip install -e '.[view]'"


def _installed(_context: click.Context, _option: click.Parameter, wanted: bool) -> bool:
    """Refuse `--view` where its extra is not installed, before anything is done."""
    if wanted and find_spec("viser") is None:
        raise Ended(NEEDS, Exit.USAGE)
    return wanted


with_view = click.option(
    "--view", is_flag=True, callback=_installed, help="Show the hand in a web page on this machine; docs/view.md."
)


class Observer(Protocol):
    """Receives the hand, events and verdicts of a command."""

    def follow(self, source: Source) -> None:
        """Observe this hand from now on."""
        ...

    def note(self, text: str, severity: Severity = "info") -> None:
        """Receive an event."""
        ...

    def give_way(self) -> None:
        """Look less often for a while, because the hand or its board is late."""
        ...

    def verdicts(self, passed: int, failed: Sequence[str]) -> None:
        """Receive the verdicts so far."""
        ...


class Nobody:
    """No-op view."""

    def follow(self, source: Source) -> None:
        """Do nothing."""

    def note(self, text: str, severity: Severity = "info") -> None:
        """Do nothing."""

    def give_way(self) -> None:
        """Do nothing."""

    def verdicts(self, passed: int, failed: Sequence[str]) -> None:
        """Do nothing."""


@contextmanager
def viewing(
    wanted: bool, hand: HandSpec, *, stay: bool = True, on_words: Callable[[str], object] | None = None
) -> Iterator[Observer]:
    """Serve a page for the time of a command, where it is wanted, and say its address on standard error.

    Put it around everything that a command does with a hand: when the page is waited for, the hand is done with.

    Args:
        wanted: whether there was `--view`.
        hand: what the command is about.
        stay: whether the page stays after the command: while a browser looks at it, and in a terminal until one has
            looked at it, or Ctrl-C.
        on_words: takes what is done to the hand on the page, in another thread; nothing can be done when None.
    """
    if not wanted:
        yield Nobody()
        return
    from aero.child_process import ChildError  # noqa: PLC0415 - help is quick
    from hil.view.feed import Feed  # noqa: PLC0415
    from hil.view.frame import Heading  # noqa: PLC0415

    feed: Feed | None = None
    try:
        feed = Feed(Heading(hand.describe(), hand.side, live=True, hands_on=on_words is not None), on_words)
    except ChildError as error:
        echo(f"{error}; the hand runs without it", err=True)
    if feed is None:
        yield Nobody()
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


def telling(observer: Observer, progress: Callable[[float, str], Any]) -> Callable[[float, str], None]:
    """Return a progress that also tells the observer of each thing that begins."""
    present = ""

    def tell(done: float, doing: str) -> None:
        nonlocal present
        progress(done, doing)
        if doing != present:
            present = doing
            observer.note(doing)

    return tell
