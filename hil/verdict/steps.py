"""Failure modes, and the steps of a case that separate them, from `steps.toml`."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import cache
from importlib import resources
from typing import Any

from aero.channels import FINGERS, Channel
from aero_hil_toml import filled, parsed
from hil.checks.shared.subjects import subject_words
from hil.verdict.part import Part
from hil.verdict.parts import Suspect


class StepOutcome(Enum):
    """Outcome of a step; values are texts for the user."""

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
"""Outcomes without the failure."""
ANSWERS = (StepOutcome.YES, StepOutcome.NO, StepOutcome.UNSURE)
RERUN = (StepOutcome.GONE, StepOutcome.STAYS, StepOutcome.PARTLY, StepOutcome.UNSURE, StepOutcome.SKIPPED)
"""Outcomes that each rerun can have."""
OF_ONE = (Part.SERVO, Part.DIGIT)
"""Parts that each channel has."""
BENDS = {
    Channel.THUMB_ABDUCTION: "Swing the thumb by hand away from the palm and back.",
    Channel.THUMB_CMC_FLEXION: "Bend the thumb by hand at its base, over the palm and back.",
    Channel.THUMB_FLEXOR: "Bend the tip of the thumb by hand and let it go.",
}
"""Manual motion of a channel without a neighbour like it."""


@dataclass(frozen=True)
class FailureMode:
    """Failure mode of a part: a row of `modes`."""

    name: str
    part: Part
    action: str
    """Action of the owner once the mode is shown."""
    reset: bool = False
    """Whether the mode is leftover state that a step has reset."""
    of_hand: bool = False
    """Whether the mode concerns the hand as a whole."""
    unplaced: bool = False
    """True for a failure mode of a servo on an unknown channel."""


class StepCheck(Enum):
    """Way in which a step shows that it was done."""

    FINGER = "finger"
    """The place of the marked servo, and the finger that moves when the channel is nudged."""
    VERSION = "version"
    """The boot text of the board."""
    BOARD = "board"
    """The serial number of the port, which differs on another board."""
    PORT = "port"
    """The USB path of the port, which a hub or another socket changes."""


Candidate = tuple[FailureMode, Channel | None]
"""Failure mode and its channel; None for a part that exists once."""


@dataclass(frozen=True)
class CaseStep:
    """Step of a case: a row of `steps`."""

    name: str
    do: str
    """Text for `str.format` with `{where}`, `{beside}` and `{bend}`; a question if `asks` is set."""
    minutes: float
    convicts: Mapping[StepOutcome, frozenset[str]] = field(default_factory=dict)
    """Modes that each outcome shows."""
    clears: Mapping[StepOutcome, frozenset[str]] = field(default_factory=dict)
    """Modes that each outcome rules out."""
    tool: str = ""
    check: StepCheck | None = None
    """How the step shows that it was done; a step without proof leaves each suspect as it was."""
    confirms: tuple[str, ...] = ()
    """Questions that the step verifies; it is useful only after an answer with yes."""
    after: tuple[str, ...] = ()
    """Steps that have priority while they are useful."""
    asks: bool = False
    """Whether the user answers with yes, no or not sure; otherwise the failed experiments rerun."""
    homes: bool = False
    frees: bool = False
    """Whether the user removes objects in contact with the hand, and reports whether there were any."""
    restores: bool = False
    """Whether the user reverts a change, so that the failure should return."""
    resets: str = ""
    """State that the step resets, for the user."""

    @property
    def runs(self) -> bool:
        """Whether the failed experiments rerun after the step."""
        return not self.asks

    @property
    def of_one_channel(self) -> bool:
        """Whether the step is done at one channel."""
        return "{where}" in self.do or "{bend}" in self.do

    @property
    def outcomes(self) -> tuple[StepOutcome, ...]:
        """Possible outcomes of the step."""
        if self.asks:
            return (*ANSWERS, StepOutcome.SKIPPED)
        told = {*self.convicts, *RERUN}
        return tuple(outcome for outcome in StepOutcome if outcome in told)

    def shows(self, candidate: Candidate, outcome: StepOutcome, at: Channel | None) -> bool:
        """Return whether an outcome of the step at a channel shows a candidate."""
        mode, channel = candidate
        return mode.name in self.convicts.get(outcome, ()) and (channel is None or at in (None, channel))

    def leaves(self, candidate: Candidate, outcome: StepOutcome, at: Channel | None) -> bool:
        """Return whether a candidate remains possible after an outcome."""
        mode, channel = candidate
        if outcome in self.convicts and outcome not in (StepOutcome.STAYS, StepOutcome.YES):
            return self.shows(candidate, outcome, at)
        here = channel is None or not self.of_one_channel or channel is at
        return not (here and mode.name in self.clears.get(outcome, ()))

    def tests(self, candidate: Candidate) -> bool:
        """Return whether some outcome would rule out a candidate."""
        return any(candidate[0].name in named for named in self.clears.values())

    def text(self, at: Channel | None, beside: Channel | None) -> str:
        """Return the step's text for a channel."""
        where, other = ("" if one is None else subject_words(one.label) for one in (at, beside))
        bend = "" if at is None else BENDS.get(at, f"Bend the {where} by hand, then the {other}.")
        return self.do.format(where=where, beside=other, bend=bend)


@cache
def modes() -> Mapping[str, FailureMode]:
    """Return the failure modes by name."""
    return {
        name: filled(FailureMode, row | {"name": name, "part": Part[row["part"].upper()]}, f"mode {name}")
        for name, row in _table()["modes"].items()
    }


@cache
def steps() -> Mapping[str, CaseStep]:
    """Return the steps by name.

    Raises:
        ValueError: a step names an unknown mode.
    """
    found = {
        name: filled(CaseStep, _by_outcome(row) | {"name": name}, f"step {name}")
        for name, row in _table()["steps"].items()
    }
    for name, step in found.items():
        named = frozenset[str]().union(*step.convicts.values(), *step.clears.values())
        if unknown := named - modes().keys():
            raise ValueError(f"step {name} names the unknown modes {sorted(unknown)}")
    return found


def candidates(suspects: Iterable[Suspect]) -> tuple[Candidate, ...]:
    """Return the failure modes of suspects."""
    return tuple(
        (mode, suspect.channel)
        for suspect in suspects
        for mode in modes().values()
        if mode.part is suspect.part and mode.unplaced == (suspect.part in OF_ONE and suspect.channel is None)
    )


def neighbour(channel: Channel, spared: frozenset[Channel] = frozenset()) -> Channel:
    """Return the nearest finger for an exchange, preferably one without failures."""
    # All servos are alike; a finger's digit shows most faults of a servo.
    free = [one for one in FINGERS if one is not channel and one not in spared]
    return min(free or [one for one in FINGERS if one is not channel], key=lambda one: abs(one - channel))


def _by_outcome(row: dict[str, Any]) -> dict[str, Any]:
    convicts, clears = dict(row.get("convicts", {})), row.get("clears", {})
    if row.get("homes"):
        convicts["gone"] = [*convicts.get("gone", ()), *(mode.name for mode in modes().values() if mode.reset)]
    named = {"convicts": convicts, "clears": clears}
    check = {"check": StepCheck(row["check"])} if "check" in row else {}
    return (
        row | check | {key: {StepOutcome[one.upper()]: told for one, told in of.items()} for key, of in named.items()}
    )


def _table() -> dict[str, Any]:
    return parsed((resources.files("hil") / "data" / "steps.toml").read_text(encoding="utf-8"), "steps.toml")
