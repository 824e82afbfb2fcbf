"""Failure modes, and the steps of a case that tell them apart, from `steps.toml`."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import cache
from importlib import resources
from typing import Any

from aero.channels import FINGERS, Channel
from hil.checks.shared.subjects import subject_words
from hil.faults.fault import Part
from hil.verdict.parts import Suspect


class StepOutcome(Enum):
    """Outcome of a step; the values are for people."""

    GONE = "the failure is gone"
    STAYS = "the failure stays"
    PARTLY = "part of the failure stays"
    FREED = "the failure is gone, and something was taken away"
    MOVED = "the failure went along"
    YES = "yes"
    NO = "no"
    UNSURE = "not sure"
    SKIPPED = "not done"


ENDED = frozenset({StepOutcome.GONE, StepOutcome.FREED})
"""Outcomes after which the failure is gone."""
ANSWERS = (StepOutcome.YES, StepOutcome.NO, StepOutcome.UNSURE)
OF_ONE = (Part.SERVO, Part.DIGIT)
"""Parts that each channel has."""
BENDS = {
    Channel.THUMB_ABDUCTION: "Swing the thumb by hand away from the palm and back.",
    Channel.THUMB_CMC_FLEXION: "Bend the thumb by hand at its base, over the palm and back.",
    Channel.THUMB_FLEXOR: "Bend the tip of the thumb by hand and let it go.",
}
"""Motion by hand of a channel that has no neighbour like it."""


@dataclass(frozen=True)
class FailureMode:
    """One way in which a part fails, by what shows or ends it: a row of `modes`."""

    name: str
    part: Part
    action: str
    """Action of the owner once it is shown."""
    reset: bool = False
    """Whether it is state that a step has put right."""
    of_hand: bool = False
    """Whether it concerns no single digit."""
    unplaced: bool = False
    """Whether it is that of a servo whose channel is not known."""


Candidate = tuple[FailureMode, Channel | None]
"""A failure mode and its channel; None for a part that the hand has once."""


@dataclass(frozen=True)
class CaseStep:
    """A row of `steps`."""

    name: str
    do: str
    """Text for `str.format` with `{where}`, `{beside}` and `{bend}`; a question if it asks."""
    minutes: float
    """Time of the person."""
    convicts: Mapping[StepOutcome, frozenset[str]] = field(default_factory=dict)
    """Modes that an outcome shows."""
    clears: Mapping[StepOutcome, frozenset[str]] = field(default_factory=dict)
    """Modes that an outcome rules out."""
    tool: str = ""
    after: tuple[str, ...] = ()
    """Steps that come first, if they tell anything."""
    asks: bool = False
    """Whether the person answers with yes, no or not sure; otherwise the failed experiments run again."""
    homes: bool = False
    """Whether the program homes the hand after it."""
    frees: bool = False
    """Whether the person takes away what touches the hand, and says whether there was something."""
    restores: bool = False
    """Whether the person puts all back as it was, so that the failure is there again."""
    resets: str = ""
    """State that it puts right, for people."""

    @property
    def runs(self) -> bool:
        """Whether the failed experiments run again after it."""
        return not self.asks

    @property
    def of_one_channel(self) -> bool:
        """Whether it is done at one channel."""
        return "{where}" in self.do or "{bend}" in self.do

    @property
    def outcomes(self) -> tuple[StepOutcome, ...]:
        """Possible outcomes."""
        if self.asks:
            return (*ANSWERS, StepOutcome.SKIPPED)
        told = {*self.convicts, StepOutcome.GONE, StepOutcome.STAYS, StepOutcome.PARTLY, StepOutcome.SKIPPED}
        return tuple(outcome for outcome in StepOutcome if outcome in told)

    def shows(self, candidate: Candidate, outcome: StepOutcome, at: Channel | None) -> bool:
        """Return whether an outcome of the step, done at a channel, shows a candidate."""
        mode, channel = candidate
        return mode.name in self.convicts.get(outcome, ()) and (channel is None or at in (None, channel))

    def leaves(self, candidate: Candidate, outcome: StepOutcome, at: Channel | None) -> bool:
        """Return whether a candidate is possible after an outcome."""
        mode, channel = candidate
        if outcome in self.convicts and outcome is not StepOutcome.STAYS:
            return self.shows(candidate, outcome, at)
        here = channel is None or not self.of_one_channel or channel is at
        return not (here and mode.name in self.clears.get(outcome, ()))

    def tests(self, candidate: Candidate) -> bool:
        """Return whether some outcome would rule a candidate out."""
        return any(candidate[0].name in named for named in self.clears.values())

    def text(self, at: Channel | None, beside: Channel | None) -> str:
        """Return the text for a channel."""
        where, other = ("" if one is None else subject_words(one.label) for one in (at, beside))
        bend = "" if at is None else BENDS.get(at, f"Bend the {where} by hand, then the {other}.")
        return self.do.format(where=where, beside=other, bend=bend)


@cache
def modes() -> Mapping[str, FailureMode]:
    """Return the failure modes by name."""
    return {name: FailureMode(name, Part[row.pop("part").upper()], **row) for name, row in _table()["modes"].items()}


@cache
def steps() -> Mapping[str, CaseStep]:
    """Return the steps by name."""
    return {name: _step(name, row) for name, row in _table()["steps"].items()}


def candidates(suspects: Iterable[Suspect]) -> tuple[Candidate, ...]:
    """Return the failure modes of suspects; of a single digit, those that concern the hand are left out."""
    suspects = tuple(suspects)
    placed = any(suspect.channel is not None for suspect in suspects)
    return tuple(
        (mode, suspect.channel)
        for suspect in suspects
        for mode in modes().values()
        if mode.part is suspect.part
        and not (mode.of_hand and placed)
        and mode.unplaced == (suspect.part in OF_ONE and suspect.channel is None)
    )


def neighbour(channel: Channel, spared: frozenset[Channel] = frozenset()) -> Channel:
    """Return the nearest finger to exchange a channel with, one that does not fail itself if there is one."""
    # All servos are alike; a finger's digit shows most of the faults of a servo.
    free = [one for one in FINGERS if one is not channel and one not in spared]
    return min(free or [one for one in FINGERS if one is not channel], key=lambda one: abs(one - channel))


def _step(name: str, row: dict[str, Any]) -> CaseStep:
    told: dict[str, Any] = {
        key: {StepOutcome[outcome.upper()]: frozenset(named) for outcome, named in row.pop(key, {}).items()}
        for key in ("convicts", "clears")
    }
    unknown = {mode for of in told.values() for named in of.values() for mode in named} - modes().keys()
    if unknown:
        raise ValueError(f"step {name} names the unknown modes {sorted(unknown)}")
    return CaseStep(name, row.pop("do"), row.pop("minutes"), **told, after=tuple(row.pop("after", ())), **row)


def _table() -> dict[str, Any]:
    return tomllib.loads((resources.files("hil") / "data" / "steps.toml").read_text(encoding="utf-8"))
