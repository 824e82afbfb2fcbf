"""Outcome of a step for one clue, from the failures of the same experiments before and after it."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from hil.checks import ALIKE, DRIVER, EXPERIMENTS, WHOLE_RUN
from hil.checks.shared.declaration import EvidenceKind
from hil.verdict.failures import BY_CHANCE, LABELS, RUN, Failures, Piece
from hil.verdict.group import Proposal
from hil.verdict.steps import StepOutcome


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


def failed_in(before: Failures, experiments: Collection[str]) -> Failures:
    """Return the failures within some experiments and within the run as a whole."""
    return before.within({*experiments, ALIKE.name, WHOLE_RUN.name, DRIVER.name, RUN})


def outcome_of(before: Failures, after: Failures, proposal: Proposal) -> StepOutcome | None:
    """Return the outcome of a step; None if inconclusive.

    Channels are compared first, kinds of evidence second: a failure may change its form. GONE: no piece of evidence
    recurs (`Failures.recurring`), and each failed reading was measured again. STAYS: the strongest piece, any chance
    event, or any evidence on the channel of a stop recurs. Anything between is PARTLY, which clears and shows no mode.
    UNSURE: a stop at another channel, or a failure that went to a channel that was not touched.
    """
    subjects = {piece.subject for piece in before.pieces} & LABELS.keys()
    again = before.recurring(after)
    if (moved := _moved(before, after, proposal)) is not None:
        return moved
    if before.strongest in again or any(piece.kind in BY_CHANCE for piece in again):
        return StepOutcome.STAYS
    # the runs of a case warm the servos up
    changed = {one for one in after.pieces if one.subject in subjects and one.kind is not EvidenceKind.OWN_SENSOR}
    if before.ended and changed:
        return StepOutcome.STAYS
    if after.ended:
        return _stopped(before, after, subjects)
    # a run to its end shows that the guard does not stop it any more
    strongest = before.strongest
    if not (after.complete if before.ended else strongest is None or strongest[:2] in after.measured):
        # A run stopped at its first gate measures few of the failed readings, and may be worse.
        return StepOutcome.STAYS if after.off else None
    # a busy computer withholds readings, and another one of their kind may pass
    withheld = {key for key in before.off if key[0] in EXPERIMENTS} - after.known
    measured = None if withheld and not after.off else StepOutcome.GONE
    return StepOutcome.PARTLY if again or changed else measured


def _stopped(before: Failures, after: Failures, subjects: Collection[str]) -> StepOutcome | None:
    """Return the outcome of a step after which the hand ended the run; `subjects` are the failed channels."""
    # a power cut or a pulled plug, unless the link was off before
    if after.link_lost and not before.kinds("hand"):
        return None
    here = {*(subjects or LABELS), "hand"}
    stopped = {subject for experiment, _, subject in after.off if experiment == RUN}
    return StepOutcome.STAYS if stopped & here else StepOutcome.UNSURE


def _moved(before: Failures, after: Failures, proposal: Proposal) -> StepOutcome | None:
    """Return MOVED if the evidence left its channel for the exchanged one, UNSURE for a third channel, else None."""
    at, beside = proposal.at, proposal.beside
    if StepOutcome.MOVED not in proposal.step.outcomes or at is None or beside is None:
        return None
    # The evidence must leave its first channel: bus noise that wanders between channels convicts no servo.
    if any(piece.subject == at.label for piece in before.recurring(after)) or not before.kinds(at.label):
        return None
    kinds = before.kinds(at.label)
    new = {piece for piece in after.pieces - before.pieces if piece.subject in LABELS}

    def arrived(piece: Piece) -> bool:
        other_form = before.ended or not after.complete
        return piece.kind in kinds or (other_form and piece.kind is not EvidenceKind.OWN_SENSOR)

    there = {piece.subject for piece in filter(arrived, new)} - {at.label}
    if beside.label in there:
        return StepOutcome.MOVED
    return StepOutcome.UNSURE if there - {piece.subject for piece in before.pieces} else None
