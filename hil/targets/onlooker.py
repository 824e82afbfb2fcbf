"""Somebody who looks at the hand and answers questions: a capability of a target, for what no encoder can see."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Question:
    """One question about a motion that was just shown; the hand is open while it is asked."""

    text: str
    legend: str
    """The answers, for people."""
    answers: Mapping[str, str]
    """What may be answered, to what it means."""
    motion: str = ""
    """What the progress called the motion that it is about; empty for the hand as it stands."""


@dataclass(frozen=True)
class Onlooker:
    """Looks and answers."""

    answer: Callable[[Question], str]
    """Returns a value of the question's `answers`; raises `KeyboardInterrupt` when nobody answers any more."""


class LookEndedError(KeyboardInterrupt):
    """The person ended the look; the hand was opened."""
