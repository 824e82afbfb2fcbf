"""Case: the ambiguity groups of a failed run, one for each clue, and the steps done since.

The rules return the clues (`suspects.py`). Each step has an outcome for each group; a closed group takes no further
part. The steps of the first open group come first, because later measurements presuppose the earlier layers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from hil.checks.shared.declaration import EvidenceKind
from hil.verdict.failures import LABELS, Failures, Piece
from hil.verdict.group import AGAIN, AmbiguityGroup, CaseState, Proposal, in_order
from hil.verdict.outcome import experiments_that_failed
from hil.verdict.parts import Suspect
from hil.verdict.run_end import FINISHED
from hil.verdict.steps import ENDED, FailureMode, StepOutcome, neighbour
from hil.verdict.suspects import LOADED, THUMB, Isolation, RunSigns, isolate

OF_A_DIGIT = LOADED | {EvidenceKind.TIME}
"""Kinds of evidence on the whole hand that one digit makes."""


@dataclass(frozen=True)
class Done:
    """Completed step."""

    proposal: Proposal
    outcomes: tuple[StepOutcome, ...]
    """Outcome for each group."""
    note: str = ""
    """Observation entered by the user."""


@dataclass(frozen=True)
class DiagnosisCase:
    """Ambiguity groups of a failed run and the steps since; immutable."""

    opened: tuple[AmbiguityGroup, ...] = ()
    """Groups of the run, before any step."""
    ran: tuple[str, ...] = ()
    """Experiments of the run until its end."""
    planned: tuple[str, ...] = ()
    """Planned experiments of the run; the failure counts as gone only after all of them pass."""
    done: tuple[Done, ...] = ()

    @cached_property
    def groups(self) -> tuple[AmbiguityGroup, ...]:
        """Groups after all steps, each until it was closed."""
        groups = list(self.opened)
        for done in self.done:
            for at, (group, outcome) in enumerate(zip(groups, done.outcomes, strict=True)):
                if group.state is CaseState.GOES_ON:
                    groups[at] = group.after(done.proposal, outcome)
        return tuple(groups)

    @cached_property
    def going_on(self) -> tuple[AmbiguityGroup, ...]:
        """Groups that a further step can separate."""
        return tuple(one for one in self.groups if one.state is CaseState.GOES_ON)

    @cached_property
    def before(self) -> Failures:
        """Failures of the groups that a further step can separate; of all groups of the run if there are none."""
        groups = self.going_on or self.opened
        off = {key: excess for one in groups for key, excess in one.before.off.items()}
        return replace(groups[0].before, off=off) if groups else Failures()

    @cached_property
    def experiments(self) -> tuple[str, ...]:
        """Experiments that reproduce the failure, in run order."""
        return experiments_that_failed(self.before, self.ran)

    @property
    def remaining(self) -> tuple[Suspect, ...]:
        """Suspects of the groups that go on, else of those whose failure recurred, ordered by part and channel."""
        recurred = [one for one in self.groups if one.state is not CaseState.NOT_SEEN_AGAIN]
        return in_order({suspect for one in self.going_on or recurred or self.groups for suspect in one.remaining})

    @property
    def shown(self) -> tuple[FailureMode, ...]:
        """Failure modes that a step has shown."""
        return tuple(dict.fromkeys(mode for one in self.groups for mode in one.shown))

    @cached_property
    def told(self) -> tuple[Suspect, ...]:
        """Convicted parts, and the suspects whose state was reset."""
        return tuple(dict.fromkeys(suspect for one in self.groups for suspect in one.told))

    @property
    def gone(self) -> bool:
        """Whether no failure is left after the last step."""
        if not self.done or self.done[-1].proposal.step.restores:
            return False
        return all(
            outcome in ENDED or one.state is CaseState.NOT_SEEN_AGAIN or one.gone
            for one, outcome in zip(self.groups, self.done[-1].outcomes, strict=True)
        )

    @property
    def mended(self) -> bool:
        """Whether no failure is left after the last step, and the cause is known."""
        return self.gone and bool(self.told)

    @cached_property
    def state(self) -> CaseState:
        """Current state of the case: that of its groups, the one that says most."""
        states = {one.state for one in self.groups}
        order = (CaseState.GOES_ON, CaseState.CONVICTED, CaseState.RESET, CaseState.OPEN, CaseState.NOT_SEEN_AGAIN)
        return next((state for state in order if state in states), CaseState.OPEN)

    @cached_property
    def next_step(self) -> Proposal | None:
        """Next step, or None once the case is closed; an exchange is with a channel that does not fail, if possible."""
        found = next((one.next_step for one in self.going_on), None)
        if found is None or found.at is None:
            return found
        pieces = {piece for one in self.opened for piece in one.before.pieces}
        failing = {LABELS[piece.subject] for piece in pieces if piece.subject in LABELS}
        moved = {one.proposal.beside for one in self.done if StepOutcome.MOVED in one.outcomes}
        spared = frozenset(one for one in failing | moved if one is not None)
        return replace(found, beside=neighbour(found.at, spared))

    def narrowed(self, recurring: frozenset[Piece]) -> DiagnosisCase:
        """Return the case after a rerun, with the groups split whose evidence recurs in part only.

        The recurring evidence is read anew: without a lost reply, late motion is evidence on its channel and no longer
        of the link. Evidence that did not recur leaves the case if nothing was changed, and is a group of its own if a
        step has ended it and no suspect of the recurring evidence explains it.

        Args:
            recurring: pieces of evidence that recurred, or were not measured again.
        """
        if not self.done:
            return self
        before = replace(self, done=self.done[:-1])
        opened, histories = list[AmbiguityGroup](), list[list[StepOutcome]]()
        for at, (group, was) in enumerate(zip(self.opened, before.groups, strict=True)):
            history = [done.outcomes[at] for done in self.done]
            parts = [(group, history[-1])]
            if was.state is CaseState.GOES_ON:
                parts = _split(group, self.done[-1], history[-1], recurring, first=len(self.done) == 1) or parts
            opened += [one for one, _ in parts]
            histories += [[*history[:-1], last] for _, last in parts]
        done = (replace(one, outcomes=each) for one, each in zip(self.done, zip(*histories, strict=True), strict=True))
        return replace(self, opened=tuple(opened), done=tuple(done))

    @property
    def by_chance(self) -> bool:
        """Whether a failure may be a single chance event, so that it must recur before any repair step."""
        return any(one.by_chance for one in self.going_on)

    def after(self, proposal: Proposal, outcomes: StepOutcome | Sequence[StepOutcome], note: str = "") -> DiagnosisCase:
        """Return the case after one more step, with one outcome for all groups or one each."""
        each = [outcomes] * len(self.opened) if isinstance(outcomes, StepOutcome) else outcomes
        return replace(self, done=(*self.done, Done(proposal, tuple(each), note)))


def groups_of(isolation: Isolation, failures: Failures) -> tuple[AmbiguityGroup, ...]:
    """Return the ambiguity groups of the clues of a run."""
    return tuple(
        AmbiguityGroup(failures.of_pieces(clue.explains), clue.strong, clue.weak, clue.seen) for clue in isolation.clues
    )


def _split(
    group: AmbiguityGroup, done: Done, outcome: StepOutcome, recurring: frozenset[Piece], *, first: bool
) -> list[tuple[AmbiguityGroup, StepOutcome]]:
    """Return the groups of a group's recurring evidence and of the rest, each with its outcome; empty if it is one."""
    left, step = group.before.pieces & recurring, done.proposal.step
    ended = group.before.pieces - left
    if group.before.ended or not left or not ended:
        return []
    if outcome is StepOutcome.MOVED:
        return _beside_moved(group, done.proposal, left)
    stay = isolate(RunSigns(group.before.of_pieces(left), FINISHED))
    found = [(one, StepOutcome.STAYS) for one in groups_of(stay, group.before)]
    if step.name == AGAIN:
        return found if first else []
    apart = frozenset(
        piece
        for piece in ended
        if (piece.subject == "hand" and piece.kind not in OF_A_DIGIT)
        or not any(clue.can_explain(piece) for clue in stay.clues)
    )
    if not apart or outcome not in (StepOutcome.STAYS, StepOutcome.PARTLY):
        return []
    # a rerun without a change shows whether the step has ended it
    ends = StepOutcome.GONE if step.restores else StepOutcome.PARTLY
    gone = isolate(RunSigns(group.before.of_pieces(apart), FINISHED))
    return [*((one, ends) for one in groups_of(gone, group.before)), *found]


def _beside_moved(
    group: AmbiguityGroup, exchanged: Proposal, left: frozenset[Piece]
) -> list[tuple[AmbiguityGroup, StepOutcome]]:
    """Return the group whose servo has moved, and the groups of what is left elsewhere; empty if nothing is.

    A consequence of the servo would have moved along; the channels of a thumb are one digit.
    """
    touched = {one for one in (exchanged.at, exchanged.beside) if one is not None}
    touched |= THUMB if touched & THUMB else set()
    elsewhere = frozenset(one for one in left if one.subject in LABELS and LABELS[one.subject] not in touched)
    if not elsewhere:
        return []
    found = groups_of(isolate(RunSigns(group.before.of_pieces(elsewhere), FINISHED)), group.before)
    moved = replace(group, before=group.before.without(elsewhere))
    return [(moved, StepOutcome.MOVED), *((one, StepOutcome.UNSURE) for one in found)]
