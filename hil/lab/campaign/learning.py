"""Entries of the fault dictionary from the faulty hands of a campaign."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from hil.faults import CATALOGUE, Fault, parse_fault
from hil.lab.campaign.trial import Outcome
from hil.verdict.dictionary import Entry
from hil.verdict.explain import explain
from hil.verdict.explanation import Explanation
from hil.verdict.limits import Limit, load_limits
from hil.verdict.signature import Key, excesses, out_of_limits, places, signature
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


def explained(outcome: Outcome, dictionary: Sequence[Entry]) -> tuple[Explanation, ...]:
    """Return what a dictionary makes of a trial, the likeliest cause first."""
    return explain(places(outcome.numbers, _limits(outcome)), outcome.ended, not_run(outcome), dictionary)


def not_run(outcome: Outcome) -> list[str]:
    """Return the experiments that did not come to their end or could not be measured."""
    return [name for name in outcome.trial.experiments if not outcome.numbers.get(name)]


def entries(outcomes: Iterable[Outcome]) -> list[Entry]:
    """Return an entry for each trial of a single fault that its hand is accused for."""
    found = []
    for outcome in outcomes:
        if len(outcome.trial.faults) != 1 or outcome.ended == "FaultNeverFiredError" or not accused(outcome):
            continue
        fault = parse_fault(outcome.trial.faults[0])
        features = signature(places(outcome.numbers, _limits(outcome)), outcome.ended, fault.channel)
        found.append(Entry(cause_of(fault), fault, features))
    return found


def _limits(outcome: Outcome) -> tuple[Limit, ...]:
    trial = outcome.trial
    return load_limits(unit_named(trial.unit).limits, trial.firmware, guarded=trial.guarded)
