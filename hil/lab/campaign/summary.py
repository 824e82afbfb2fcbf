"""What a campaign says about the checks: which hands they flag, from which severity on, and what is said of them."""

from __future__ import annotations

import tomllib
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources

from scipy.stats import binomtest

from hil.checks.shared.subjects import subject_words
from hil.faults import CATALOGUE, Fault, parse_fault
from hil.lab.campaign.trial import Outcome
from hil.verdict.limits import Key, excesses, load_limits, out_of_limits
from model.units.naming import unit_named

CONFIDENCE = 0.95
NOT_FIRED = "FaultNeverFiredError"


@dataclass(frozen=True)
class Share:
    """So many of so many, with the interval that holds the true share with a probability of `CONFIDENCE`."""

    count: int
    of: int

    @property
    def value(self) -> float:
        """The share."""
        return self.count / self.of

    @property
    def interval(self) -> tuple[float, float]:
        """Clopper and Pearson's interval."""
        found = binomtest(self.count, self.of).proportion_ci(CONFIDENCE)
        return float(found.low), float(found.high)

    def __str__(self) -> str:
        low, high = self.interval
        return f"{self.count} of {self.of} ({low:.1%} to {high:.1%})"


@dataclass(frozen=True)
class Detection:
    """One fault in one severity on several hands."""

    name: str
    severity: float
    unit: str
    found: Share
    checks: tuple[tuple[str, int], ...]
    """`experiment/metric` and in how many hands it failed, the most first."""
    located: int
    """Hands, of those found, whose diagnosis names the right place."""
    explained: int
    """Hands, of those found, whose causes hold the right one."""
    furthest: float
    """Of the hands that were not found, the largest part of the way from healthy readings to a limit, 0 to 1."""


def flagged(outcome: Outcome) -> bool:
    """Return whether the present limits flag the hand of a trial."""
    return bool(outcome.stopped) or any(out_of_limits(excess) for excess in judged(outcome).values())


def judged(outcome: Outcome) -> dict[Key, float]:
    """Return the excesses of a trial by the present limits of its hand."""
    trial = outcome.trial
    return excesses(outcome.numbers, load_limits(unit_named(trial.unit).limits, trial.firmware, guarded=trial.guarded))


@cache
def _expected() -> Mapping[str, Mapping[str, Sequence[str]]]:
    text = resources.files("hil.lab.campaign").joinpath("expected.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def right_place(fault: Fault, place: str) -> bool:
    """Return whether a diagnosis that names a place, `Location.words`, is right about a fault."""
    places = _expected()["place"].get(CATALOGUE[fault.name].cause, ())
    return place in places or (fault.channel is not None and subject_words(fault.channel.label) in place)


def right_cause(fault: Fault, row: str) -> bool:
    """Return whether a row of `diagnoses.toml` holds the cause of a fault."""
    return row in _expected()["row"].get(CATALOGUE[fault.name].cause, ())


def detections(outcomes: Iterable[Outcome]) -> tuple[Detection, ...]:
    """Return a row for each fault and severity, in the order of the catalogue."""
    groups: dict[tuple[str, float], list[Outcome]] = defaultdict(list)
    for outcome in outcomes:
        if len(outcome.trial.faults) == 1 and outcome.ended != NOT_FIRED:
            fault = parse_fault(outcome.trial.faults[0])
            groups[fault.name, fault.severity].append(outcome)
    order = list(CATALOGUE)
    return tuple(
        _detection(name, severity, groups[name, severity])
        for name, severity in sorted(groups, key=lambda key: (order.index(key[0]), _rank(*key)))
    )


def _detection(name: str, severity: float, group: Sequence[Outcome]) -> Detection:
    failed: dict[str, int] = defaultdict(int)
    found = located = explained = 0
    furthest = 0.0
    for outcome in group:
        if not flagged(outcome):
            furthest = max(furthest, *map(abs, judged(outcome).values()), 0.0)
            continue
        found += 1
        for check in {f"{key[0]}/{key[1]}" for key, excess in judged(outcome).items() if out_of_limits(excess)}:
            failed[check] += 1
        if outcome.stopped:
            failed[f"stopped: {outcome.ended or 'gate'}"] += 1
        fault = parse_fault(outcome.trial.faults[0])
        located += right_place(fault, outcome.place)
        explained += right_cause(fault, outcome.row)
    ranked = tuple(sorted(failed.items(), key=lambda item: (-item[1], item[0])))
    unit = CATALOGUE[name].unit
    return Detection(name, severity, unit, Share(found, len(group)), ranked, located, explained, furthest)


def false_alarms(outcomes: Iterable[Outcome]) -> tuple[Share, dict[str, int]]:
    """Return how many healthy hands are flagged, and how often each check, `experiment/metric/subject`, did it."""
    healthy = [outcome for outcome in outcomes if not outcome.trial.faults]
    by_check: dict[str, int] = defaultdict(int)
    for outcome in healthy:
        for key, excess in judged(outcome).items():
            if out_of_limits(excess):
                by_check["/".join(key)] += 1
    return Share(sum(map(flagged, healthy)), len(healthy)), dict(by_check)


def _rank(name: str, severity: float) -> float:
    """Return how severe a severity of a fault is; for some faults less is worse."""
    mild, _, severe = CATALOGUE[name].severities
    return severity if severe >= mild else -severity
