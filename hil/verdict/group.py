"""Ambiguity group of one clue: its suspects, and what each step clears, shows or convicts.

A step clears failure modes or shows some. The next step is the cheapest that tests a mode of the group, preferring
steps without a tool. A part is convicted when a step has shown it and no other suspect of the group remains. An answer
of the owner shows a mode, too, but convicts only after the part's other questions are answered, and after the mend,
where a step tries it. Once no step tests the group any further, and it is shown by elimination at most, the weak
suspects that all digits share join it. No likelihoods are used; minutes order the steps.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from enum import Enum, auto
from functools import cached_property

from aero.channels import Channel
from hil.verdict.failures import BY_CHANCE, Failures
from hil.verdict.part import Part
from hil.verdict.parts import Suspect
from hil.verdict.steps import (
    ENDED,
    OF_ONE,
    Candidate,
    CaseStep,
    FailureMode,
    StepOutcome,
    candidates,
    neighbour,
    steps,
)
from hil.verdict.suspects import THUMB

AGAIN = "again"
"""Name of the step that reruns without any change."""


@dataclass(frozen=True)
class Proposal:
    """Proposed step, with its channels."""

    step: CaseStep
    at: Channel | None = None
    beside: Channel | None = None

    @property
    def text(self) -> str:
        """Instruction or question shown to the user."""
        return self.step.text(self.at, self.beside)


@dataclass(frozen=True)
class Taken:
    """Completed step with its outcome for one group."""

    proposal: Proposal
    outcome: StepOutcome

    @property
    def changed(self) -> bool:
        """Whether the step may have changed the failure without showing it, so that the next one would be blamed."""
        step = self.proposal.step
        # what a step has put back is there again
        doubtful = self.outcome is StepOutcome.PARTLY or (self.outcome is StepOutcome.UNSURE and step.runs)
        return doubtful and not step.restores


class CaseState(Enum):
    """State of a group or a case."""

    GOES_ON = auto()
    """A further step can separate the suspects."""
    CONVICTED = auto()
    """A step has shown one part, and no other suspect remains."""
    RESET = auto()
    """A step has reset leftover state; nothing is broken."""
    NOT_SEEN_AGAIN = auto()
    """The failure did not recur although nothing was changed."""
    OPEN = auto()
    """No step separates the remaining suspects."""


@dataclass(frozen=True)
class AmbiguityGroup:
    """Suspects of one clue and the steps since; immutable."""

    before: Failures
    """Failures that the clue explains."""
    strong: frozenset[Suspect] = frozenset()
    weak: frozenset[Suspect] = frozenset()
    seen: str = ""
    """Observation of the clue, as a sentence without a full stop."""
    taken: tuple[Taken, ...] = ()

    def after(self, proposal: Proposal, outcome: StepOutcome) -> AmbiguityGroup:
        """Return the group after one more step."""
        return replace(self, taken=(*self.taken, Taken(proposal, outcome)))

    @cached_property
    def settled(self) -> tuple[Taken, ...]:
        """Steps with their final outcomes.

        A step of which part remained may mend late: a rerun without a change, directly after it, decides its outcome.
        """
        found: list[Taken] = []
        for one in self.taken:
            if one.proposal.step.name == AGAIN and found and found[-1].outcome is StepOutcome.PARTLY:
                found[-1] = replace(found[-1], outcome=one.outcome)
            else:
                found.append(one)
        return tuple(found)

    @cached_property
    def candidates(self) -> tuple[Candidate, ...]:
        """Remaining strong candidates, else weak ones; those of an answered part while an answer shows one.

        The weak suspects that all digits share join strong ones that no further step tests and no outcome has shown,
        other than by elimination.
        """
        found = self._base
        asked = {(mode.part, channel) for mode, channel in found if self._answered((mode, channel))}
        return tuple(one for one in found if (one[0].part, one[1]) in asked) or found

    @cached_property
    def _base(self) -> tuple[Candidate, ...]:
        strong = self._left(self.strong)
        if not strong:
            return self._left(self.weak)
        directly = any(self._showing(one) - {StepOutcome.STAYS} for one in strong)
        if directly or self.gone or self._useful(strong):
            return strong
        return self._left(self.strong | {one for one in self.weak if one.channel is None})

    @cached_property
    def remaining(self) -> tuple[Suspect, ...]:
        """Suspects of the group, ordered by part and channel."""
        return in_order({Suspect(mode.part, channel) for mode, channel in self.candidates})

    @cached_property
    def shown(self) -> tuple[FailureMode, ...]:
        """Failure modes of the group that a step has shown; those that an answer names, if there are any."""
        found = [one for one in self.candidates if self._showing(one)]
        answered = [one for one in found if self._answered(one)]
        return tuple(dict.fromkeys(mode for mode, _ in answered or found))

    @cached_property
    def convicted(self) -> tuple[Suspect, ...]:
        """Part that a step has shown, if it is the only remaining suspect; the thumb's digits count as one part."""
        found = self.remaining
        thumb = all(one.part is Part.DIGIT and one.channel in THUMB for one in found)
        alone = self.shown and (len(found) == 1 or thumb)
        return found if alone and not self._unconfirmed else ()

    @cached_property
    def told(self) -> tuple[Suspect, ...]:
        """Convicted part, or the suspects whose state was reset; otherwise empty."""
        return self.remaining if self.state is CaseState.RESET else self.convicted

    @cached_property
    def gone(self) -> bool:
        """Whether the failure is gone after the last step."""
        last = self.settled[-1:]
        return any(one.outcome in ENDED and not one.proposal.step.restores for one in last)

    @cached_property
    def state(self) -> CaseState:
        """Current state of the group."""
        modes = [mode for mode, _ in self.candidates]
        if self.gone and modes and all(mode.reset for mode in modes):
            return CaseState.RESET
        if self.convicted:
            return CaseState.CONVICTED
        if self.gone:
            again = self.settled[-1].proposal.step.name == AGAIN
            return CaseState.NOT_SEEN_AGAIN if again else CaseState.OPEN
        return CaseState.OPEN if self._next is None else CaseState.GOES_ON

    @cached_property
    def next_step(self) -> Proposal | None:
        """Next step, or None once the group is closed."""
        return self._next if self.state is CaseState.GOES_ON else None

    @cached_property
    def by_chance(self) -> bool:
        """Whether the failure may be a single chance event, so that it must recur before any repair step."""
        return len(self.before.off) == 1 or any(piece.kind in BY_CHANCE for piece in self.before.pieces)

    def _left(self, suspects: frozenset[Suspect]) -> tuple[Candidate, ...]:
        return tuple(
            one
            for one in candidates(in_order(suspects))
            if all(taken.proposal.step.leaves(one, taken.outcome, taken.proposal.at) for taken in self.settled)
            and not (one[0].reset and self._mended_otherwise)
        )

    @cached_property
    def _mended_otherwise(self) -> bool:
        """Whether a repair ended a failure that had survived an earlier homing; no reset state was the cause then."""
        settled = self.settled
        if not settled or settled[-1].outcome not in ENDED or settled[-1].proposal.step.resets:
            return False
        return any(one.proposal.step.homes and one.outcome is StepOutcome.STAYS for one in settled[:-1])

    def _showing(self, candidate: Candidate) -> set[StepOutcome]:
        """Return the outcomes that show a candidate."""
        return {one.outcome for one in self.settled if one.proposal.step.shows(candidate, one.outcome, one.proposal.at)}

    def _answered(self, candidate: Candidate) -> bool:
        return StepOutcome.YES in self._showing(candidate)

    @cached_property
    def _unconfirmed(self) -> list[Proposal]:
        """Steps that have to confirm an answer: questions about the same part, and the step that mends it."""
        found = self.candidates
        if self.gone or not any(map(self._answered, found)):
            return []
        asking = [one for one in self._useful(found) if one.step.asks and not one.step.tool]
        return asking or [
            one
            for one in self._open_steps(found)
            if any(one.step.shows(mode, StepOutcome.GONE, one.at) for mode in found if self._answered(mode))
        ]

    @cached_property
    def _next(self) -> Proposal | None:
        again = Proposal(steps()[AGAIN])
        if not self.taken and self.by_chance:
            return again
        last = self.taken[-1] if self.taken else None
        if last and last.changed and last.proposal != again:
            return again
        useful = self._unconfirmed or self._useful(self.candidates)
        names = {one.step.name for one in useful}
        ready = [one for one in useful if names.isdisjoint(one.step.after)]
        return min(ready, key=lambda one: (bool(one.step.tool), one.step.minutes), default=None)

    def _useful(self, group: Collection[Candidate]) -> list[Proposal]:
        """Return the open steps that test a candidate of a group."""
        return [
            one
            for one in self._open_steps(group)
            if not one.step.confirms and any(map(one.step.tests, _within(group, one.at)))
        ]

    def _open_steps(self, group: Collection[Candidate]) -> Iterable[Proposal]:
        """Yield the steps that were not tried yet, at each channel of a group."""
        tried = {(one.proposal.step.name, one.proposal.at) for one in self.taken}
        failing = frozenset(channel for _, channel in candidates(self.strong) if channel is not None)
        channels = {channel for mode, channel in group if mode.part in OF_ONE and channel is not None}
        # the channel with most evidence first: a neighbour may only lean on it
        places = sorted(channels, key=lambda one: (-len(self.before.kinds(one.label)), one))
        for step in steps().values():
            for at in places if step.of_one_channel else [None]:
                if (step.name, at) not in tried:
                    yield Proposal(step, at, None if at is None else neighbour(at, failing))


def _within(group: Iterable[Candidate], at: Channel | None) -> Iterable[Candidate]:
    return (one for one in group if at is None or one[1] is at)


def in_order(suspects: Iterable[Suspect]) -> tuple[Suspect, ...]:
    """Return suspects ordered by part and channel."""
    return tuple(sorted(suspects, key=_place))


def _place(suspect: Suspect) -> tuple[int, int]:
    return list(Part).index(suspect.part), -1 if suspect.channel is None else suspect.channel
