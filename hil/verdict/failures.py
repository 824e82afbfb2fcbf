"""The readings of a run that are off: what every rule of the diagnosis reads."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field

from aero.channels import Channel
from hil.checks import Measured
from hil.verdict.limits import Key, Limit, excesses, out_of_limits
from hil.verdict.run_end import FINISHED, EndKind, RunEnd

FAR = 4.0
"""Excess from which on a reading counts no more: how far it is off is no measure of how much it says. Failures that
weigh less together may be a healthy hand's, or another part's that shows most there."""
RUN = "run"
"""Stands for an experiment in the failure of a run that the hand ended."""
HANDS_FAULT = {EndKind.STOPPED, EndKind.LINK, EndKind.FIRMWARE}
LABELS = {channel.label: channel for channel in Channel}


@dataclass(frozen=True)
class Failures:
    """Readings out of limits, by experiment, metric and subject."""

    off: Mapping[Key, float] = field(default_factory=dict)
    """Excess (`Limit.excess`), beyond 1 or below -1."""
    known: frozenset[Key] = frozenset()
    """Readings that were measured and judged, those within limits among them."""

    @classmethod
    def of(cls, numbers: Mapping[str, Measured], limits: Collection[Limit], end: RunEnd = FINISHED) -> Failures:
        """Return the failures of a run: its readings, one that is not measurable aside, and what ended it."""
        found = excesses(numbers, limits)
        known = {key: excess for key, excess in found.items() if excess is not None}
        off = {key: excess for key, excess in known.items() if out_of_limits(excess)}
        if end.kind in HANDS_FAULT:
            off[RUN, "ended", "hand" if end.channel is None else end.channel.label] = FAR
        return cls(off, frozenset(known))

    def on(self, check: str, sign: int = 0) -> frozenset[Channel]:
        """Return the channels on which a check, `experiment/metric`, is off: too high by 1, too low by -1, any by 0."""
        return frozenset(
            LABELS[subject]
            for (experiment, metric, subject), excess in self.off.items()
            if f"{experiment}/{metric}" == check and subject in LABELS and (not sign or excess * sign > 0)
        )

    def keys(self, wanted: Callable[[str, str], bool]) -> frozenset[Key]:
        """Return the failures whose check and subject are wanted."""
        return frozenset(key for key in self.off if wanted(f"{key[0]}/{key[1]}", key[2]))

    def hand(self, *checks: str) -> frozenset[Key]:
        """Return the failures of the whole hand in some checks."""
        return self.keys(lambda check, subject: subject == "hand" and check in checks)

    def weight(self, keys: Iterable[Key]) -> float:
        """Return how much some of the failures say."""
        return sum(min(abs(self.off[key]), FAR) for key in keys if key in self.off)

    def excess(self, check: str, subject: str) -> float:
        """Return how far a reading is off; 0 within its limits."""
        experiment, metric = check.split("/")
        return self.off.get((experiment, metric, subject), 0.0)
