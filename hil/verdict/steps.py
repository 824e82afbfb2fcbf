"""The steps of a case, as data: what a person does, and what each outcome says about each part."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cache
from importlib import resources
from typing import Any

from aero.channels import FINGERS, Channel
from hil.checks.shared.subjects import subject_words
from hil.faults.fault import Part
from hil.verdict.parts import Suspect


class StepOutcome(Enum):
    """What came of a step; the values are for people."""

    GONE = "the failure is gone"
    STAYS = "the failure stays"
    FREED = "the failure is gone, and something was taken away"
    MOVED = "the failure went along"
    SEEN = "yes"


BY_CHANCE = 0.015
"""Likelihood of an outcome that a part has no reason for: a loose plug was touched, a mild fault just passed."""
SELDOM = 0.005
"""Likelihood that a failure stays where a step ends it."""
OF_ONE = (Part.SERVO, Part.DIGIT)
"""Parts that each channel has."""


@dataclass(frozen=True)
class Way:
    """One way in which a part may be at fault, by what ends or shows it."""

    part: Part
    name: str = ""
    """Empty for a part that has one way."""


@dataclass(frozen=True)
class CaseStep:
    """A row of `steps.toml`."""

    name: str
    do: str
    """What the person does, a text for `str.format` with `{where}` and `{beside}`; a question where it asks."""
    minutes: float
    """Of the person's time."""
    likely: Mapping[Way, Mapping[StepOutcome, float]]
    """By the way of being at fault, how likely each outcome is; the rest is `STAYS`."""
    convicts: Mapping[StepOutcome, tuple[Part, ...]]
    """The parts of which an outcome proves the likelier."""
    tool: str = ""
    homes: bool = False
    """Whether the program homes the hand after it."""
    frees: bool = False
    """Whether the person takes away what touches the hand, and says whether there was something."""
    restores: bool = False
    """Whether the person puts all back as it was, so that the failure is there again."""
    after_homing: bool = False
    """Whether homing alone must have changed nothing before, where that may mend a suspect."""

    @property
    def asks(self) -> bool:
        """Whether the person answers."""
        return any(StepOutcome.SEEN in of for of in self.likely.values())

    @property
    def runs(self) -> bool:
        """Whether what shows the failure is run, where the person has seen nothing."""
        return any(of.keys() != {StepOutcome.SEEN} for of in self.likely.values())

    @property
    def of_one_channel(self) -> bool:
        """Whether it is done at one channel, beside another."""
        return "{where}" in self.do

    @property
    def outcomes(self) -> tuple[StepOutcome, ...]:
        """What may come of it."""
        named = {outcome for of in self.likely.values() for outcome in of}
        return tuple(outcome for outcome in StepOutcome if outcome in named or outcome is StepOutcome.STAYS)

    def likelihood(
        self, outcome: StepOutcome, way: Way, channel: Channel | None, at: Channel | None, chance: float = BY_CHANCE
    ) -> float:
        """Return how likely an outcome is where a part of a channel is at fault and the step is done at another.

        `chance` is how likely the failure is gone without a reason.
        """
        elsewhere = self.of_one_channel and channel is not None and channel is not at
        of = {} if elsewhere else self.likely.get(way, {})
        named = [one for one in self.outcomes if one is not StepOutcome.STAYS]
        likely: dict[StepOutcome, float] = {
            one: max(of.get(one, 0.0), chance if one is StepOutcome.GONE else BY_CHANCE) for one in named
        }
        likely[StepOutcome.STAYS] = max(SELDOM, 1.0 - sum(likely.values()))
        return likely[outcome] / sum(likely.values())

    def convicted(self, outcome: StepOutcome, at: Channel | None) -> tuple[Suspect, ...]:
        """Return the suspects of which an outcome proves the likelier at a channel."""
        return tuple(Suspect(part, at if part in OF_ONE else None) for part in self.convicts.get(outcome, ()))

    def text(self, at: Channel | None, beside: Channel | None) -> str:
        """Return what the person does at a channel."""
        words = {
            name: "" if one is None else subject_words(one.label) for name, one in (("where", at), ("beside", beside))
        }
        return self.do.format(**words)


@cache
def ways() -> Mapping[Part, Mapping[Way, float]]:
    """Return the ways of each part, and how often each is its."""
    shares = {Part[part.upper()]: of for part, of in _table()["ways"].items()}
    return {part: {Way(part, name): share for name, share in shares.get(part, {"": 1.0}).items()} for part in Part}


@cache
def steps() -> Mapping[str, CaseStep]:
    """Return the steps by name."""
    return {
        name: CaseStep(
            name,
            row["do"],
            row["minutes"],
            {
                way: {StepOutcome[outcome.upper()]: share for outcome, share in of.items()}
                for words, of in row["likely"].items()
                for way in _named(words)
            },
            {
                StepOutcome[outcome.upper()]: tuple(Part[part.upper()] for part in parts)
                for outcome, parts in row["convicts"].items()
            },
            row.get("tool", ""),
            row.get("homes", False),
            row.get("frees", False),
            row.get("restores", False),
            row.get("after_homing", False),
        )
        for name, row in _table()["steps"].items()
    }


def _named(words: str) -> Iterable[Way]:
    """Return the ways that `part` or `part-way` names."""
    part, _, name = words.partition("-")
    return [way for way in ways()[Part[part.upper()]] if name in ("", way.name)]


def _table() -> dict[str, Any]:
    return tomllib.loads((resources.files("hil") / "data" / "steps.toml").read_text(encoding="utf-8"))


def neighbour(channel: Channel, spared: frozenset[Channel] = frozenset()) -> Channel:
    """Return the nearest finger that a channel is exchanged with, none of those that fail themselves if one is left."""
    # All servos are alike; a finger's digit shows most of what a servo may have.
    free = [one for one in FINGERS if one is not channel and one not in spared]
    return min(free or [one for one in FINGERS if one is not channel], key=lambda one: abs(one - channel))
