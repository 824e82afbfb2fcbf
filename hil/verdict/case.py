"""Case: the suspects of a failed run, and what each later step clears or convicts.

The rules return an ambiguity group (`suspects.py`). Each step clears failure modes or shows some. The next step is the
cheapest that tests a mode of the group, preferring steps without a tool. A part is convicted when a step has shown it
and no other suspect of the group remains. Once no step tests the group any further, and it is shown by elimination at
most, the weak suspects that all digits share join it. No likelihoods are used; minutes order the steps.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from enum import Enum, auto

from aero.channels import Channel
from hil.checks import ALIKE, DRIVER, EXPERIMENTS, WHOLE_RUN
from hil.checks.shared.declaration import EvidenceKind
from hil.verdict.failures import BY_CHANCE, LABELS, RUN, Failures
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
class Done:
    """Completed step."""

    proposal: Proposal
    outcome: StepOutcome
    note: str = ""
    """Observation entered by the user."""


class CaseState(Enum):
    """State of a case."""

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
class DiagnosisCase:
    """Suspects of a failed run and the steps since; immutable."""

    before: Failures
    """Failures of the run."""
    strong: frozenset[Suspect] = frozenset()
    weak: frozenset[Suspect] = frozenset()
    experiments: tuple[str, ...] = ()
    """Experiments that reproduce the failure, in run order."""
    ran: tuple[str, ...] = ()
    """Experiments of the run until its end."""
    planned: tuple[str, ...] = ()
    """Planned experiments of the run; the failure counts as gone only after all of them pass."""
    done: tuple[Done, ...] = ()

    @property
    def group(self) -> tuple[Candidate, ...]:
        """Ambiguity group after all steps: remaining strong candidates, else remaining weak ones.

        The weak suspects that all digits share join strong ones that no further step tests and no outcome has shown,
        other than by elimination.
        """
        strong = self._left(self.strong)
        if not strong:
            return self._left(self.weak)
        directly = any(self._showing(one) - {StepOutcome.STAYS} for one in strong)
        if directly or self.gone or self._useful(strong):
            return strong
        return self._left(self.strong | {one for one in self.weak if one.channel is None})

    @property
    def remaining(self) -> tuple[Suspect, ...]:
        """Suspects of the group, ordered by part and channel."""
        found = {Suspect(mode.part, channel) for mode, channel in self.group}
        return tuple(sorted(found, key=_order))

    @property
    def shown(self) -> tuple[FailureMode, ...]:
        """Failure modes of the group that a step has shown."""
        found = (mode for mode, channel in self.group if self._is_shown((mode, channel)))
        return tuple(dict.fromkeys(found))

    @property
    def convicted(self) -> Suspect | None:
        """Part that a step has shown, if it is the only remaining suspect."""
        alone = self.remaining[0] if len(self.remaining) == 1 else None
        return alone if alone is not None and self.shown else None

    @property
    def told(self) -> tuple[Suspect, ...]:
        """Convicted part, or the suspects whose state was reset; otherwise empty."""
        if self.state is CaseState.RESET:
            return self.remaining
        return () if self.convicted is None else (self.convicted,)

    @property
    def gone(self) -> bool:
        """Whether the failure is gone after the last step."""
        return bool(self.done) and self.done[-1].outcome in ENDED and not self.done[-1].proposal.step.restores

    @property
    def mended(self) -> bool:
        """Whether the failure is gone after the last step, and its cause is known."""
        return self.gone and bool(self.told)

    @property
    def state(self) -> CaseState:
        """Current state of the case."""
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
        """Next step, or None once the case is closed."""
        return self._next if self.state is CaseState.GOES_ON else None

    @property
    def by_chance(self) -> bool:
        """Whether the failure may be a single chance event, so that it must recur before any repair step."""
        return len(self.before.off) == 1 or any(piece.kind in BY_CHANCE for piece in self.before.pieces)

    def after(self, proposal: Proposal, outcome: StepOutcome, note: str = "") -> DiagnosisCase:
        """Return the case after one more step."""
        return replace(self, done=(*self.done, Done(proposal, outcome, note)))

    def failed_in(self, experiments: Collection[str]) -> Failures:
        """Return the failures within some experiments and within the run as a whole."""
        return self.before.within({*experiments, ALIKE.name, WHOLE_RUN.name, DRIVER.name, RUN})

    def _left(self, suspects: frozenset[Suspect]) -> tuple[Candidate, ...]:
        return tuple(
            one
            for one in candidates(sorted(suspects, key=_order))
            if all(done.proposal.step.leaves(one, done.outcome, done.proposal.at) for done in self.done)
            and not (one[0].reset and self._mended_otherwise)
        )

    @property
    def _mended_otherwise(self) -> bool:
        """Whether a repair ended a failure that had survived an earlier homing; no reset state was the cause then."""
        if not self.done or self.done[-1].outcome not in ENDED or self.done[-1].proposal.step.resets:
            return False
        return any(one.proposal.step.homes and one.outcome is StepOutcome.STAYS for one in self.done[:-1])

    def _is_shown(self, candidate: Candidate) -> bool:
        return bool(self._showing(candidate))

    def _showing(self, candidate: Candidate) -> set[StepOutcome]:
        """Return the outcomes that show a candidate."""
        return {one.outcome for one in self.done if one.proposal.step.shows(candidate, one.outcome, one.proposal.at)}

    @property
    def _next(self) -> Proposal | None:
        if not self.done and self.by_chance:
            return Proposal(steps()[AGAIN])
        useful = self._useful(self.group)
        names = {one.step.name for one in useful}
        ready = [one for one in useful if names.isdisjoint(one.step.after)]
        return min(ready, key=lambda one: (bool(one.step.tool), one.step.minutes), default=None)

    def _useful(self, group: Collection[Candidate]) -> list[Proposal]:
        """Return the open steps that test a candidate of a group."""
        tried = {(one.proposal.step.name, one.proposal.at) for one in self.done}
        failing = frozenset(channel for _, channel in candidates(self.strong) if channel is not None)
        found = []
        for step in steps().values():
            places: list[Channel | None] = [None]
            if step.of_one_channel:
                channels = {channel for mode, channel in group if mode.part in OF_ONE and channel is not None}
                # the channel with most evidence first: a neighbour may only lean on it
                places = [*sorted(channels, key=lambda one: (-len(self.before.kinds(one.label)), one))]
            for at in places:
                own = [one for one in group if not step.of_one_channel or one[1] is at]
                if (step.name, at) not in tried and any(map(step.tests, own)):
                    found.append(Proposal(step, at, None if at is None else neighbour(at, failing)))
        return found


def _order(suspect: Suspect) -> tuple[int, int]:
    return list(Part).index(suspect.part), -1 if suspect.channel is None else suspect.channel


def experiments_that_failed(failures: Failures, ran: Sequence[str]) -> tuple[str, ...]:
    """Return the quickest experiments that together show all evidence; all experiments if the run was aborted.

    Lost bytes and aborts are chance events: a shorter rerun might pass on a hand that still has the fault.
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
    """Return the outcome of a step from the failures of the same experiments before and after; None if inconclusive.

    GONE: no piece of evidence recurs, and each failed reading was measured again. STAYS: the strongest piece or any
    chance event recurs. Anything between is PARTLY, which clears and shows no mode.
    """
    at, beside, strongest = proposal.at, proposal.beside, before.strongest
    again = before.pieces & after.pieces
    if StepOutcome.MOVED in proposal.step.outcomes and at is not None and beside is not None:
        kinds = before.kinds(at.label)
        arrived = {piece for piece in after.pieces - before.pieces if piece.subject == beside.label}
        # The evidence must also leave its first channel: bus noise that wanders between channels convicts no servo.
        left = all(piece.subject != at.label for piece in again)
        if left and arrived and (not after.complete or any(piece.kind in kinds for piece in arrived)):
            return StepOutcome.MOVED
    if strongest in again or any(piece.kind in BY_CHANCE for piece in again):
        return StepOutcome.STAYS
    if after.ended:
        # a power cut or a pulled plug, unless the link was off before
        return None if after.link_lost and not before.kinds("hand") else StepOutcome.STAYS
    # a run to its end shows that the guard does not stop it any more
    covered = after.complete if before.ended else strongest is None or strongest[:2] in after.measured
    if not covered:
        # A run stopped at its first gate measures few of the failed readings, and may be worse.
        return StepOutcome.STAYS if after.off else None
    subjects = {piece.subject for piece in before.pieces} & LABELS.keys()
    # the runs of a case warm the servos up
    changed = any(one.subject in subjects and one.kind is not EvidenceKind.OWN_SENSOR for one in after.pieces)
    if again or changed:
        return StepOutcome.PARTLY
    # a busy computer withholds readings, and another one of their kind may pass
    withheld = {key for key in before.off if key[0] in EXPERIMENTS} - after.known
    return None if withheld and not after.off else StepOutcome.GONE
