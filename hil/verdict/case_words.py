"""A case in words: what is suspected, why a step comes next, what came of each, and how the case ends."""

from __future__ import annotations

from hil.checks.shared.subjects import subject_words
from hil.verdict.case import DiagnosisCase, Done, Proposal
from hil.verdict.parts import Part, Suspect, listed
from hil.verdict.steps import StepOutcome

MEND = {
    Part.COMPUTER: "Use another computer, or close what else runs on this one.",
    Part.DRIVER: "Correct the driver or the map; its findings name the channel.",
    Part.USB: "Replace the USB cable, or connect the hand without the hub.",
    Part.BOARD: "Flash the board again; if the failure returns, replace it.",
    Part.SUPPLY: "Replace the supply, or its wires where the voltage is low only under load.",
    Part.BUS: "Replace the plug or the lead that was loose.",
    Part.SERVO: "Replace this servo.",
    Part.DIGIT: "Look at the cable, the springs, the joints and the stops of this digit, and mend what differs.",
    Part.SETUP: "Nothing is broken: leave the hand as it is now.",
}
"""What to do with a part that a step has convicted."""


def asked(proposal: Proposal) -> str:
    """Return what a person is asked to do, with its minutes and its tool."""
    tool = f", with {proposal.step.tool}" if proposal.step.tool else ""
    minutes = f"{proposal.step.minutes:g} minute{'s' if proposal.step.minutes != 1 else ''}"
    return f"{proposal.text} ({minutes}{tool})"


def why(case: DiagnosisCase, proposal: Proposal) -> str:
    """Return why a step comes next: what its outcomes would prove."""
    said = [
        f"{outcome.value}: {listed(map(str, suspects))}"
        for outcome in proposal.step.outcomes
        # That something was taken away makes what is gone surer, of the same part.
        if outcome is not StepOutcome.FREED and (suspects := proposal.step.convicted(outcome, proposal.at))
    ]
    proves = f"If {'; if '.join(said)}." if said else "What happened once must fail again before a step can mend it."
    return f"Suspected: {listed(map(str, case.remaining))}. {proves}"


def came_of(done: Done) -> str:
    """Return what was done, and what came of it."""
    note, seen = f" ({done.note})" if done.note else "", done.outcome is StepOutcome.SEEN
    said = f"no; {done.outcome.value}" if done.proposal.step.asks and not seen else done.outcome.value
    return f"{done.proposal.text} {said[0].upper()}{said[1:]}{note}."


def conclusion(case: DiagnosisCase) -> str:
    """Return how a case stands: the part that a step has convicted, or what remains."""
    found: Suspect | None = case.convicted
    if found is not None:
        name = str(found)
        return f"{name[0].upper()}{name[1:]}{_now_at(case, found)}. {MEND[found.part]}"
    if case.gone:
        likeliest = listed(map(str, case.remaining))
        return f"The failure is gone, and no part is convicted. If it returns, look first at: {likeliest}."
    if not case.remaining:
        return "Nothing is known."
    return f"Not isolated. What remains: {listed(map(str, case.remaining))}."


def _now_at(case: DiagnosisCase, found: Suspect) -> str:
    """Say where a servo is that was exchanged: a person would replace the good one that is in its place."""
    where = found.channel
    for one in (done.proposal for done in case.done if StepOutcome.MOVED in done.proposal.step.outcomes):
        where = {one.at: one.beside, one.beside: one.at}.get(where, where)
    moved = found.part is Part.SERVO and where is not None and where is not found.channel
    return f", which is now at the {subject_words(where.label)}" if moved and where else ""
