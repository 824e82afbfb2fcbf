"""Texts of a case: suspects, reasons for a step, outcomes, conclusion."""

from __future__ import annotations

from hil.checks.shared.subjects import subject_words
from hil.verdict.case import CaseState, DiagnosisCase, Done, Proposal
from hil.verdict.part import Part
from hil.verdict.parts import Suspect, listed
from hil.verdict.steps import StepOutcome


def asked(proposal: Proposal) -> str:
    """Return the instruction of a step, with its minutes and tool."""
    tool = f", with {proposal.step.tool}" if proposal.step.tool else ""
    minutes = f"{proposal.step.minutes:g} minute{'s' if proposal.step.minutes != 1 else ''}"
    return f"{proposal.text} ({minutes}{tool})"


def why(case: DiagnosisCase, proposal: Proposal) -> str:
    """Return the reason for a step: the suspects, and the part that each outcome would show."""
    step, told = proposal.step, []
    for outcome in step.outcomes:
        # FREED is omitted: it shows the same part as GONE, with more certainty.
        if outcome is StepOutcome.FREED or outcome not in step.convicts:
            continue
        shown = {
            Suspect(mode.part, channel)
            for mode, channel in case.group
            if step.shows((mode, channel), outcome, proposal.at)
        }
        if shown:
            every = len(shown) > 1 and shown == {*case.remaining}
            told.append(f"{outcome.value}: {'any of them' if every else listed(sorted(map(str, shown)))}")
    proves = f"If {'; if '.join(told)}." if told else "What happened once must fail again before a step can mend it."
    return f"Suspected: {listed(map(str, case.remaining))}. {proves}"


def outcome_text(done: Done) -> str:
    """Return a completed step with its outcome."""
    note, said = f" ({done.note})" if done.note else "", done.outcome.value
    return f"{done.proposal.text} {said[0].upper()}{said[1:]}{note}."


def conclusion(case: DiagnosisCase) -> str:
    """Return the state of a case, with the recommended action."""
    state, remaining = case.state, listed(map(str, case.remaining)) if case.remaining else ""
    action = " ".join(mode.action for mode in case.shown)
    if state is CaseState.RESET:
        reset = case.done[-1].proposal.step.resets or "state that was left behind"
        returns = "; ".join(f"{Suspect(mode.part, channel)}: {mode.action}" for mode, channel in case.group)
        return f"Nothing is broken. The step reset {reset}. If the failure returns, look at the {returns}."
    if (found := case.convicted) is not None:
        name = str(found)
        return f"{name[0].upper()}{name[1:]}{_now_at(case, found)}. {action}"
    if state is CaseState.NOT_SEEN_AGAIN:
        return f"The failure did not recur, and no part is convicted. If it returns, look first at: {remaining}."
    if not remaining:
        return "No part that is known to the rules explains the failure."
    return f"{'The failure is gone, but not isolated' if case.gone else 'Not isolated'}. What remains: {remaining}."


def _now_at(case: DiagnosisCase, found: Suspect) -> str:
    """Return the present position of an exchanged servo, so that the user does not replace the good one."""
    where = found.channel
    for one in (done.proposal for done in case.done if StepOutcome.MOVED in done.proposal.step.outcomes):
        where = {one.at: one.beside, one.beside: one.at}.get(where, where)
    if found.part is not Part.SERVO or where is None or where is found.channel:
        return ""
    return f", which is now at the {subject_words(where.label)}"
