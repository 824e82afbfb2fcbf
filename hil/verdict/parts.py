"""What a validation suspects: a part, on a channel where it is one of several."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from aero.channels import Channel
from hil.checks.shared.subjects import subject_words
from hil.faults.fault import Part

__all__ = ["Part", "Suspect", "listed", "place"]


FEW = 4
"""Places that a heading names one by one."""


@dataclass(frozen=True)
class Suspect:
    """A part that may be at fault."""

    part: Part
    channel: Channel | None = None
    """Of a servo or a digit; None for a part that the hand has once."""

    def __str__(self) -> str:
        """Return the part's name, with its channel."""
        return (
            self.part.value if self.channel is None else f"{self.part.value} of the {subject_words(self.channel.label)}"
        )


def listed(words: Iterable[str]) -> str:
    """Return words as a list for people: `a, b or c`."""
    *first, last = words
    return f"{', '.join(first)} or {last}" if first else last


def place(suspects: Iterable[Suspect]) -> str:
    """Return where suspects are, for a heading: a digit where both its servo and itself are among them."""
    words = (s.part.value if s.channel is None else subject_words(s.channel.label) for s in suspects)
    found = tuple(dict.fromkeys(words))
    if len(found) > FEW:
        return "parts that all digits share"
    return listed(found) if found else ""
