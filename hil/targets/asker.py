"""The person at the hand: questions as data, with typed answers, and what the person is shown.

A terminal, a page or a played owner is an `Asker`. Whoever asks does not know which.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from aero.channels import Channel

Answer = TypeVar("Answer")


@dataclass(frozen=True)
class Question(ABC, Generic[Answer]):
    """Something that only the person knows."""

    text: str

    @abstractmethod
    def read(self, line: str) -> Answer:
        """Return the answer that a line of text gives.

        Raises:
            ValueError: none; the message lists what may be answered.
        """

    @abstractmethod
    def line(self, answer: Answer) -> str:
        """Return the line that `read` takes for an answer, for a file."""


@dataclass(frozen=True)
class Option(Generic[Answer]):
    """One answer of several; a button on a page."""

    label: str
    answer: Answer
    key: str = ""
    """Typed for it; Enter alone where empty."""


@dataclass(frozen=True)
class Choice(Question[Answer]):
    """One of several answers; of an act that is to be done, `Done` is the only one."""

    options: tuple[Option[Answer], ...]
    motion: str = ""
    """Motion in the progress that it is about; empty for the hand as it is."""

    @property
    def legend(self) -> str:
        """The keys and their labels, for a terminal."""
        return ", ".join(f"{one.key or 'Enter'} {one.label}" for one in self.options)

    def read(self, line: str) -> Answer:
        """Return the answer of a key, a label or the answer itself.

        Raises:
            ValueError: there is no such answer.
        """
        typed = line.strip().lower()
        for option in self.options:
            if typed in (option.key, option.label.lower(), str(option.answer).lower()):
                return option.answer
        raise ValueError(f"{line.strip()!r} is none of: {self.legend}")

    def line(self, answer: Answer) -> str:
        """Return the label of an answer."""
        return next(one.label for one in self.options if one.answer == answer)


@dataclass(frozen=True)
class FreeText(Question[str]):
    """Free text, which may be empty."""

    def read(self, line: str) -> str:
        """Return the text."""
        return line.strip()

    def line(self, answer: str) -> str:
        """Return the text."""
        return answer


YES_OR_NO = (Option("yes", True, "y"), Option("no", False, "n"))


@dataclass(frozen=True)
class StepShown:
    """The step of a case that comes next."""

    do: str
    why: str
    minutes: float
    """Of the person's time."""
    tool: str = ""
    """Empty for none."""
    channels: tuple[Channel, ...] = ()
    """Digits to be touched."""


@dataclass(frozen=True)
class CaseShown:
    """How a case stands."""

    done: tuple[str, ...] = ()
    """The steps so far, each with its outcome."""
    step: StepShown | None = None
    """None once the case is closed."""
    conclusion: str = ""
    """Empty while it is open."""


@dataclass(frozen=True)
class Motion:
    """A motion of the hand that is about to begin."""

    text: str
    """Channels, time, and what stops it, for people."""
    channels: tuple[Channel, ...]
    seconds: float
    """Longest time from its beginning to its end, s."""


class Asker(Protocol):
    """Somebody at the hand, and the way to reach them."""

    def ask(self, question: Question[Answer]) -> Answer:
        """Return the person's answer.

        Raises:
            KeyboardInterrupt: nobody answers any more, or the person stops.
        """

    def show(self, case: CaseShown) -> None:
        """Show how a case stands."""

    def announce(self, motion: Motion) -> None:
        """Show what will move before it does."""

    def progress(self, part: float, doing: str, left_s: float) -> None:
        """Show how far the announced motion is, 0 to 1, and the time that it takes still, s; 1 ends it."""

    def tell(self, text: str) -> None:
        """Show a line."""
