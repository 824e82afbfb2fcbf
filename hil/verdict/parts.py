"""Suspected parts, each on a channel where the hand has several."""

from collections.abc import Iterable
from dataclasses import dataclass

from aero.channels import Channel
from hil.checks.shared.subjects import subject_words
from hil.verdict.part import Part

FEW = 4
"""Limit of locations that a heading lists individually."""


@dataclass(frozen=True)
class Suspect:
    """Part that may be at fault."""

    part: Part
    channel: Channel | None = None
    """Channel of a servo or a digit; None for a part that exists once."""

    def __str__(self) -> str:
        """Return the part's name, with its channel if known."""
        if self.channel is not None:
            return f"{self.part.value} of the {subject_words(self.channel.label)}"
        return f"one of the {self.part.value}s" if self.part in {Part.SERVO, Part.DIGIT} else self.part.value


def listed(words: Iterable[str]) -> str:
    """Return words as a list in a sentence: `a, b or c`."""
    *first, last = words
    return f"{', '.join(first)} or {last}" if first else last


def place(suspects: Iterable[Suspect]) -> str:
    """Return the suspects' locations for a heading: the digit's name for its servo and mechanics."""
    words = (s.part.value if s.channel is None else subject_words(s.channel.label) for s in suspects)
    found = tuple(dict.fromkeys(words))
    if len(found) > FEW:
        return "parts that all digits share"
    return listed(found) if found else ""
