"""A cause that may explain a run."""

from __future__ import annotations

from dataclasses import dataclass

from aero.channels import Channel
from hil.faults.fault import Fault


@dataclass(frozen=True)
class Explanation:
    """One cause, where it sits, and how likely it is among those that are known."""

    cause: str
    """Name of a kind of fault, or of a group that looks alike on this wire."""
    channel: Channel | None
    """Where; None for the whole hand."""
    probability: float
    fault: Fault
    """The known fault that is most like the run."""
    meaning: str = ""
    """What it is, for people."""
    next_look: str = ""
    """What would tell it from the next likely one."""

    @property
    def sentence(self) -> str:
        """The cause in one sentence."""
        where = "the hand" if self.channel is None else self.channel.label
        return f"{self.probability:.0%} {self.cause} ({where}): {self.meaning}"
