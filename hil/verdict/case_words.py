"""A case in words: what is suspected, why a step comes next, what came of each, and how the case ends."""

from __future__ import annotations

from hil.verdict.case import DiagnosisCase, Done, Proposal
from hil.verdict.parts import Part, Suspect, listed

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
        f"{outcome.value}: {suspect}"
        for outcome in proposal.step.outcomes
        if (suspect := proposal.step.convicted(outcome, proposal.at)) is not None
    ]
    return f"Suspected: {listed(map(str, case.remaining))}. If {'; if '.join(said)}."


def came_of(done: Done) -> str:
    """Return what was done, and what came of it."""
    note = f" ({done.note})" if done.note else ""
    return f"{done.proposal.text} {done.outcome.value[0].upper()}{done.outcome.value[1:]}{note}."


def conclusion(case: DiagnosisCase) -> str:
    """Return how a case stands: the part that a step has convicted, or what remains."""
    found: Suspect | None = case.convicted
    if found is not None:
        name = str(found)
        return f"{name[0].upper()}{name[1:]}. {MEND[found.part]}"
    if case.gone:
        likeliest = listed(map(str, case.remaining))
        return f"The failure is gone, and no part is convicted. If it returns, look first at: {likeliest}."
    if not case.remaining:
        return "Nothing is known."
    return f"Not isolated. What remains: {listed(map(str, case.remaining))}."
