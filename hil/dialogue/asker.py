"""Dialogue with the person at the hand: questions with typed answers, and messages, as data.

`Asker` is implemented by a terminal, a page and a simulated owner.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from aero.channels import Channel

Answer = TypeVar("Answer")
READ_S = 0.5
"""Time that a question is shown before a choice is accepted, s; above the interval of a double click."""


@dataclass(frozen=True)
class Question(ABC, Generic[Answer]):
    """Question to the person at the hand."""

    text: str

    @abstractmethod
    def read(self, line: str) -> Answer:
        """Parse an answer from a line of text.

        Raises:
            ValueError: invalid answer; the message names the valid ones.
        """

    @abstractmethod
    def line(self, answer: Answer) -> str:
        """Return an answer as a line that `read` parses, for a file."""


@dataclass(frozen=True)
class Option(Generic[Answer]):
    """Possible answer to a question; a button on a page."""

    label: str
    answer: Answer
    key: str = ""
    """Key on a terminal; without one the label is typed. Enter alone answers no choice: it may be one too many."""


@dataclass(frozen=True)
class Choice(Question[Answer]):
    """Question with several answers, or only `Done` for a requested act."""

    options: tuple[Option[Answer], ...]
    motion: str = ""
    """Name of the motion in question; empty for the hand at rest."""
    noticed: object = None
    """Observation of a helper that looked; None if the person looks."""

    @property
    def legend(self) -> str:
        """Keys and labels of the options, for a terminal."""
        return ", ".join(f"{one.key} {one.label}" if one.key else f"type {one.label!r}" for one in self.options)

    def read(self, line: str) -> Answer:
        """Return the answer for its key, its label or its own text.

        Raises:
            ValueError: no option matches the line.
        """
        typed = line.strip().lower()
        for option in self.options:
            if typed and typed in (option.key, option.label.lower(), str(option.answer).lower()):
                return option.answer
        raise ValueError(f"{line.strip()!r} is none of: {self.legend}")

    def line(self, answer: Answer) -> str:
        """Return the label of an answer."""
        return next(one.label for one in self.options if one.answer == answer)


@dataclass(frozen=True)
class FreeText(Question[str]):
    """Question with a free text as answer, possibly empty."""

    def read(self, line: str) -> str:
        """Return the text."""
        return line.strip()

    def line(self, answer: str) -> str:
        """Return the text."""
        return answer


YES_OR_NO = (Option("yes", True, "y"), Option("no", False, "n"))


@dataclass(frozen=True)
class StepShown:
    """Next step of a case, for display."""

    do: str
    why: str
    minutes: float
    tool: str = ""
    """Required tool; empty for none."""
    channels: tuple[Channel, ...] = ()
    """Digits to be touched."""


@dataclass(frozen=True)
class CaseShown:
    """Status of a case, for display."""

    done: tuple[str, ...] = ()
    """Finished steps with their outcomes."""
    step: StepShown | None = None
    conclusion: str = ""
    page: str = ""
    """Path of the page of a closed case."""


@dataclass(frozen=True)
class Motion:
    """Announced motion of the hand."""

    text: str
    """Channels, duration and stop conditions, as text for display."""
    channels: tuple[Channel, ...]
    seconds: float
    """Longest duration of the motion, s."""


class Asker(Protocol):
    """Dialogue channel to the person at the hand."""

    def ask(self, question: Question[Answer]) -> Answer:
        """Return the person's answer.

        Raises:
            KeyboardInterrupt: the dialogue has ended, or the person stops the program.
        """

    def show(self, case: CaseShown) -> None:
        """Show the status of a case."""

    def announce(self, motion: Motion) -> None:
        """Show a motion before its start."""

    def progress(self, part: float, doing: str, left_s: float) -> None:
        """Show the progress of the announced motion, 0 to 1 (finished), and its remaining time, s."""

    def tell(self, text: str) -> None:
        """Show a line."""
