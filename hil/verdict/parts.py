"""What a validation suspects: a part, on a channel where it is one of several."""

from __future__ import annotations

from dataclasses import dataclass

from aero.channels import Channel
from hil.faults.part import Part

__all__ = ["Part", "Suspect"]


@dataclass(frozen=True)
class Suspect:
    """A part that may be at fault."""

    part: Part
    channel: Channel | None = None
    """Of a servo or a digit; None for a part that the hand has once."""

    def __str__(self) -> str:
        """Return the part's name, with its channel."""
        return self.part.value if self.channel is None else f"{self.part.value} of {self.channel.label}"
