"""Texts of a case: suspects, reasons for a step, outcomes, conclusion."""

from __future__ import annotations

from aero.printable import capital
from hil.checks.shared.subjects import subject_words
from hil.verdict.case import DiagnosisCase, Done
from hil.verdict.group import AmbiguityGroup, CaseState, Proposal, in_order
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
    candidates = [one for group in case.going_on or case.groups for one in group.candidates]
    for outcome in step.outcomes:
        # FREED is omitted: it shows the same part as GONE, with more certainty.
        if outcome is StepOutcome.FREED or outcome not in step.convicts:
            continue
        shown = {Suspect(one[0].part, one[1]) for one in candidates if step.shows(one, outcome, proposal.at)}
        if shown:
            every = len(shown) > 1 and shown == {*case.remaining}
            told.append(f"{outcome.value}: {'any of them' if every else listed(sorted(map(str, shown)))}")
    proves = (
        f"If {'; if '.join(told)}."
        if told
        else "The failure may have been a chance event; it must recur before a repair can be tested."
    )
    return f"Suspected: {listed(map(str, case.remaining))}. {proves}"


def outcome_text(done: Done) -> str:
    """Return a completed step with its outcomes."""
    said = "; ".join(dict.fromkeys(outcome.value for outcome in done.outcomes))
    note = f" ({done.note})" if done.note else ""
    return f"{done.proposal.text} {capital(said)}{note}."


def conclusion(case: DiagnosisCase) -> str:
    """Return the state of a case, with the recommended actions."""
    groups = case.groups
    told = [one for one in groups if one.told]
    if not told:
        if all(one.state is CaseState.NOT_SEEN_AGAIN for one in groups):
            left = listed(map(str, case.remaining))
            return f"The failure did not recur, and no part is convicted. If it returns, look first at: {left}."
        return _open(case)
    said = [_told(one) for one in told]
    said += [_open(case)] if any(one.state is CaseState.OPEN and not one.gone for one in groups) else []
    said += [f"Seen once only: {one.seen}." for one in groups if one.seen and one.state is CaseState.NOT_SEEN_AGAIN]
    return " ".join(dict.fromkeys(said))


def _open(case: DiagnosisCase) -> str:
    left = [one for one in case.groups if not one.told and one.state is CaseState.OPEN and one.gone is case.gone]
    remaining = in_order({suspect for one in left for suspect in one.remaining})
    if not remaining:
        return "No part that is known to the rules explains the failure."
    state = "The failure is gone, but not isolated" if case.gone else "Not isolated"
    return f"{state}. What remains: {listed(map(str, remaining))}."


def _told(group: AmbiguityGroup) -> str:
    """Return the convicted part of a group, or its reset state."""
    if group.state is CaseState.RESET:
        reset = group.settled[-1].proposal.step.resets or "state that was left behind"
        returns = "; ".join(f"{Suspect(mode.part, channel)}: {mode.action}" for mode, channel in group.candidates)
        return f"Nothing is broken. The step reset {reset}. If the failure returns, look at the {returns}."
    found = group.convicted
    name = str(found[0]) if len(found) == 1 else "digit of the thumb"
    action = " ".join(mode.action for mode in group.shown)
    if group.gone and group.settled[-1].proposal.step.confirms:
        action = f"It is mended. If the failure returns: {action[0].lower()}{action[1:]}"
    return f"{capital(name)}{_now_at(group, found[0])}. {action}"


def _now_at(group: AmbiguityGroup, found: Suspect) -> str:
    """Return the present position of an exchanged servo, so that the user does not replace the good one."""
    where = found.channel
    for one in (taken.proposal for taken in group.settled if StepOutcome.MOVED in taken.proposal.step.outcomes):
        where = {one.at: one.beside, one.beside: one.at}.get(where, where)
    if found.part is not Part.SERVO or where is None or where is found.channel:
        return ""
    return f", which is now at the {subject_words(where.label)}"
