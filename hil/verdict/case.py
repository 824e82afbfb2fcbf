"""A case: the suspects of a failed run, the steps since, and what they clear and convict.

The rules leave an ambiguity group (`suspects.py`). Each step clears failure modes, or shows some. The next step is the
cheapest that tests a mode of the group, without a tool first. A part is convicted when a step has shown it and no
other suspect of the group is left. No likelihood decides; minutes order the steps.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from enum import Enum, auto

from aero.channels import Channel
from hil.checks import ALIKE, DRIVER, EXPERIMENTS, WHOLE_RUN
from hil.verdict.failures import BY_CHANCE, LABELS, RUN, Failures
from hil.verdict.parts import Part, Suspect
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

AGAIN = "again"
"""Step that changes nothing."""


@dataclass(frozen=True)
class Proposal:
    """A step at a place."""

    step: CaseStep
    at: Channel | None = None
    beside: Channel | None = None

    @property
    def text(self) -> str:
        """Instruction or question for the person."""
        return self.step.text(self.at, self.beside)


@dataclass(frozen=True)
class Done:
    """A step that was done."""

    proposal: Proposal
    outcome: StepOutcome
    note: str = ""
    """Observation of the person."""


class CaseState(Enum):
    """State of a case."""

    GOES_ON = auto()
    """A step tells more."""
    CONVICTED = auto()
    """A step has shown one part, and no other is left."""
    RESET = auto()
    """A step has put state right that was left behind; nothing is broken."""
    NOT_SEEN_AGAIN = auto()
    """The failure did not come again although nothing was changed."""
    OPEN = auto()
    """No step tells the remaining suspects apart."""


@dataclass(frozen=True)
class DiagnosisCase:
    """Suspects of a failed run and the steps since; pure."""

    before: Failures
    """Failures of the run."""
    strong: frozenset[Suspect] = frozenset()
    weak: frozenset[Suspect] = frozenset()
    experiments: tuple[str, ...] = ()
    """Experiments that show the failure, in the order in which they run."""
    ran: tuple[str, ...] = ()
    """Experiments of the run, until it ended."""
    planned: tuple[str, ...] = ()
    """Experiments that the run would have done: only when all of them pass is the failure gone."""
    done: tuple[Done, ...] = ()

    @property
    def group(self) -> tuple[Candidate, ...]:
        """The ambiguity group after all steps: strong candidates that are left, else weak ones."""
        return self._left(self.strong) or self._left(self.weak)

    @property
    def remaining(self) -> tuple[Suspect, ...]:
        """The suspects of the group, in the order of parts and channels."""
        found = {Suspect(mode.part, channel) for mode, channel in self.group}
        return tuple(sorted(found, key=_order))

    @property
    def shown(self) -> tuple[FailureMode, ...]:
        """The modes of the group that a step has shown."""
        found = (mode for mode, channel in self.group if self._is_shown((mode, channel)))
        return tuple(dict.fromkeys(found))

    @property
    def convicted(self) -> Suspect | None:
        """The part that a step has shown, if no other suspect is left."""
        alone = self.remaining[0] if len(self.remaining) == 1 else None
        return alone if alone is not None and self.shown else None

    @property
    def told(self) -> tuple[Suspect, ...]:
        """The convicted part, or those whose state was reset; empty otherwise."""
        if self.state is CaseState.RESET:
            return self.remaining
        return () if self.convicted is None else (self.convicted,)

    @property
    def gone(self) -> bool:
        """Whether the failure is gone after the last step."""
        return bool(self.done) and self.done[-1].outcome in ENDED and not self.done[-1].proposal.step.restores

    @property
    def state(self) -> CaseState:
        """How the case stands."""
        modes = [mode for mode, _ in self.group]
        if self.gone and modes and all(mode.reset for mode in modes):
            return CaseState.RESET
        if self.convicted is not None:
            return CaseState.CONVICTED
        if self.gone:
            again = self.done[-1].proposal.step.name == AGAIN
            return CaseState.NOT_SEEN_AGAIN if again else CaseState.OPEN
        return CaseState.OPEN if self._next is None else CaseState.GOES_ON

    @property
    def next_step(self) -> Proposal | None:
        """The next step; None once the case is closed."""
        return self._next if self.state is CaseState.GOES_ON else None

    def after(self, proposal: Proposal, outcome: StepOutcome, note: str = "") -> DiagnosisCase:
        """Return the case with one more step done."""
        return replace(self, done=(*self.done, Done(proposal, outcome, note)))

    def failed_in(self, experiments: Collection[str]) -> Failures:
        """Return the failures of some experiments and of the run as a whole."""
        return self.before.within({*experiments, ALIKE.name, WHOLE_RUN.name, DRIVER.name, RUN})

    def _left(self, suspects: frozenset[Suspect]) -> tuple[Candidate, ...]:
        return tuple(
            one
            for one in candidates(sorted(suspects, key=_order))
            if all(done.proposal.step.leaves(one, done.outcome, done.proposal.at) for done in self.done)
        )

    def _is_shown(self, candidate: Candidate) -> bool:
        return any(done.proposal.step.shows(candidate, done.outcome, done.proposal.at) for done in self.done)

    @property
    def _next(self) -> Proposal | None:
        if not self.done and self._may_be_chance:
            return Proposal(steps()[AGAIN])
        useful = self._useful()
        names = {one.step.name for one in useful}
        ready = [one for one in useful if names.isdisjoint(one.step.after)]
        return min(ready, key=lambda one: (bool(one.step.tool), one.step.minutes), default=None)

    @property
    def _may_be_chance(self) -> bool:
        """Whether the failure may have happened once: it must fail again before a step can mend it."""
        pieces = self.before.pieces
        return len(pieces) == 1 or any(piece.kind in BY_CHANCE for piece in pieces)

    def _useful(self) -> list[Proposal]:
        """Return the steps that are not done and test a candidate of the group."""
        tried = {(one.proposal.step.name, one.proposal.at) for one in self.done}
        group = self.group
        failing = frozenset(channel for _, channel in candidates(self.strong) if channel is not None)
        found = []
        for step in steps().values():
            places: list[Channel | None] = [None]
            if step.of_one_channel:
                places = [channel for mode, channel in group if mode.part in OF_ONE and channel is not None]
            for at in dict.fromkeys(places):
                own = [one for one in group if not step.of_one_channel or one[1] is at]
                if (step.name, at) not in tried and any(map(step.tests, own)):
                    found.append(Proposal(step, at, None if at is None else neighbour(at, failing)))
        return found


def _order(suspect: Suspect) -> tuple[int, int]:
    return list(Part).index(suspect.part), -1 if suspect.channel is None else suspect.channel


def experiments_that_failed(failures: Failures, ran: Sequence[str]) -> tuple[str, ...]:
    """Return the quickest experiments that together show all the evidence of a run; all of them where a run ended.

    Bytes are lost by chance, and a run ends where it does by chance: less of it might pass on the same hand.
    """
    if {experiment for experiment, _, _ in failures.off} & {RUN, WHOLE_RUN.name, DRIVER.name}:
        return tuple(ran)
    chosen = set[str]()
    for piece in failures.pieces:
        showing = {name for name in ran if piece in failures.within({name}).pieces}
        if showing.isdisjoint(chosen):
            quickest = min(showing, key=lambda name: EXPERIMENTS[name].hand_s, default=None)
            chosen |= set(ran) if quickest is None else {quickest}
    return tuple(name for name in ran if name in chosen)


def outcome_of(before: Failures, after: Failures, proposal: Proposal) -> StepOutcome | None:
    """Return the outcome of a step, from what the same experiments found before and after it.

    Gone is a failure of which no piece fails again; it stays when the strongest piece fails again, or any that comes by
    chance. Anything between is known in part, and says nothing. None if too little was measured again.
    """
    at, beside, strongest = proposal.at, proposal.beside, before.strongest
    again = before.pieces & after.pieces
    ended = any(key[0] == RUN for key in after.off)
    if StepOutcome.MOVED in proposal.step.outcomes and at is not None and beside is not None:
        kinds = before.kinds(at.label)
        arrived = {piece for piece in after.pieces - before.pieces if piece.subject == beside.label}
        # It must have left: noise on the bus that wanders over the channels convicts no servo.
        left = all(piece.subject != at.label for piece in again)
        if left and arrived and (ended or any(piece.kind in kinds for piece in arrived)):
            return StepOutcome.MOVED
    if ended or strongest in again or any(piece.kind in BY_CHANCE for piece in again):
        return StepOutcome.STAYS
    if strongest is not None and (strongest.subject, strongest.kind) not in after.measured:
        # A run that ends at its first gate measures little of what failed, and may fail worse.
        return StepOutcome.STAYS if after.off else None
    subjects = {piece.subject for piece in before.pieces} & LABELS.keys()
    changed = any(piece.subject in subjects for piece in after.pieces)
    return StepOutcome.PARTLY if again or changed else StepOutcome.GONE
