"""How a run ended, as far as that tells one cause from another."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Self

from aero.channels import Channel
from hil.verdict.run_end import RunEnd, Way
from hil.verdict.signature import MOST, Places

GATE = "gate"
"""Stands for an error where a gate failed."""
ERRORS = ("ConnectionError", "DesyncError", "LinkTimeoutError", "SafetyStopError")
"""Errors that runs of known faults end with."""
CHANNEL_STOPS = {
    "hot": r"is at \d+ °C",
    "jumped": r"'s encoder jumped",
    "moved": r"moved by .* without a command",
    "elsewhere": r"stands at .* was only sent to",
    "current": r"has drawn more than",
    "at_rest": r"draws .* at rest",
}
"""Why the guard stops a hand for one channel, and the words in which it says so after the channel's name."""
HAND_STOPS = {
    "repeated": r"positions and currents have repeated",
    "silent": r"has not answered for",
}
"""Why it stops one for its link or its board."""


@dataclass(frozen=True)
class EndSignature:
    """What ended a run."""

    error: str = ""
    """Name of the error, `GATE` for a failed gate, empty when everything ran."""
    reason: str = ""
    """What it said."""

    @classmethod
    def of(cls, end: RunEnd) -> Self:
        """Return the ending of a judged run."""
        return cls(GATE if end.way is Way.GATE else end.error_name, end.reason)

    @property
    def places(self) -> Places:
        """The ending as readings that are as far off as any: the guard's reason, or else the error."""
        if not self.error:
            return {}
        for channel in Channel:
            for stop, words in CHANNEL_STOPS.items():
                if re.search(rf"\b{channel.label} ?{words}", self.reason):
                    return {("ended", stop, channel.label): MOST}
        stops = (stop for stop, words in HAND_STOPS.items() if re.search(words, self.reason))
        return {("ended", next(stops, self.error), "hand"): MOST}
