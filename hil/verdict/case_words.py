"""A case in words: what is suspected, why a step comes next, what came of each, and how the case ends."""

from __future__ import annotations

from hil.checks.shared.subjects import subject_words
from hil.verdict.case import CaseState, DiagnosisCase, Done, Proposal
from hil.verdict.parts import Part, Suspect, listed
from hil.verdict.steps import StepOutcome


def asked(proposal: Proposal) -> str:
    """Return what a person is asked to do, with its minutes and its tool."""
    tool = f", with {proposal.step.tool}" if proposal.step.tool else ""
    minutes = f"{proposal.step.minutes:g} minute{'s' if proposal.step.minutes != 1 else ''}"
    return f"{proposal.text} ({minutes}{tool})"


def why(case: DiagnosisCase, proposal: Proposal) -> str:
    """Return the reason for a step: the suspects, and what its outcomes would show."""
    step, told = proposal.step, []
    for outcome in step.outcomes:
        # That something was taken away makes the same part surer.
        if outcome is StepOutcome.FREED or outcome not in step.convicts:
            continue
        shown = {
            Suspect(mode.part, channel)
            for mode, channel in case.group
            if step.shows((mode, channel), outcome, proposal.at)
        }
        if shown:
            told.append(f"{outcome.value}: {listed(sorted(map(str, shown)))}")
    proves = f"If {'; if '.join(told)}." if told else "What happened once must fail again before a step can mend it."
    return f"Suspected: {listed(map(str, case.remaining))}. {proves}"


def outcome_text(done: Done) -> str:
    """Return a step that was done, with its outcome."""
    note, said = f" ({done.note})" if done.note else "", done.outcome.value
    return f"{done.proposal.text} {said[0].upper()}{said[1:]}{note}."


def conclusion(case: DiagnosisCase) -> str:
    """Return how a case stands, with the action that follows."""
    state, remaining = case.state, listed(map(str, case.remaining)) if case.remaining else ""
    action = " ".join(mode.action for mode in case.shown)
    if state is CaseState.RESET:
        reset = case.done[-1].proposal.step.resets
        return f"Nothing is broken. The step reset {reset or 'state that was left behind'}. {action}"
    if (found := case.convicted) is not None:
        name = str(found)
        return f"{name[0].upper()}{name[1:]}{_now_at(case, found)}. {action}"
    if state is CaseState.NOT_SEEN_AGAIN:
        return f"The failure did not come again, and no part is convicted. If it returns, look first at: {remaining}."
    if not remaining:
        return "No part that is known to the rules explains the failure."
    return f"{'The failure is gone, but not isolated' if case.gone else 'Not isolated'}. What remains: {remaining}."


def _now_at(case: DiagnosisCase, found: Suspect) -> str:
    """Return where an exchanged servo is now: a person would replace the good one in its place."""
    where = found.channel
    for one in (done.proposal for done in case.done if StepOutcome.MOVED in done.proposal.step.outcomes):
        where = {one.at: one.beside, one.beside: one.at}.get(where, where)
    if found.part is not Part.SERVO or where is None or where is found.channel:
        return ""
    return f", which is now at the {subject_words(where.label)}"
