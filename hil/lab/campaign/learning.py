"""Entries of the fault dictionary from the faulty hands of a campaign."""

from __future__ import annotations

from collections.abc import Iterable

from hil.faults import CATALOGUE, Fault, parse_fault
from hil.lab.campaign.trial import Outcome
from hil.verdict.dictionary import Entry
from hil.verdict.ending import GATE, EndSignature
from hil.verdict.explanation import Diagnosis
from hil.verdict.limits import Limit, load_limits
from hil.verdict.reference import Reference
from hil.verdict.signature import Key, Places, excesses, out_of_limits, places, signature
from model.units.naming import unit_named


def cause_of(fault: Fault) -> str:
    """Return what a finding should name for a fault."""
    return CATALOGUE[fault.name].cause


def accused(outcome: Outcome) -> bool:
    """Return whether the present limits accuse the hand of a trial."""
    return bool(outcome.stopped) or any(out_of_limits(excess) for excess in judged(outcome).values())


def judged(outcome: Outcome) -> dict[Key, float]:
    """Return the excesses of a trial by the present limits of its hand."""
    return excesses(outcome.numbers, _limits(outcome))


def seen(outcome: Outcome) -> Places:
    """Return where the readings of a trial lie among those of healthy hands, and how it ended."""
    error = outcome.ended or (GATE if outcome.stopped else "")
    return {**places(outcome.numbers, _limits(outcome)), **EndSignature(error, outcome.stopped).places}


def diagnosed(outcome: Outcome, reference: Reference) -> Diagnosis:
    """Return what a reference makes of a trial."""
    return reference.diagnosed(seen(outcome), judged(outcome))


def telling(outcomes: Iterable[Outcome]) -> list[Outcome]:
    """Return the trials of a single fault that its hand is accused for: those that something is learned from."""
    return [
        outcome
        for outcome in outcomes
        if len(outcome.trial.faults) == 1 and outcome.ended != "FaultNeverFiredError" and accused(outcome)
    ]


def entries(outcomes: Iterable[Outcome]) -> list[Entry]:
    """Return an entry for each trial of a single fault that its hand is accused for."""
    found = []
    for outcome in telling(outcomes):
        fault = parse_fault(outcome.trial.faults[0])
        found.append(Entry(cause_of(fault), fault, signature(seen(outcome), fault.channel)))
    return found


def _limits(outcome: Outcome) -> tuple[Limit, ...]:
    trial = outcome.trial
    return load_limits(unit_named(trial.unit).limits, trial.firmware, guarded=trial.guarded)
