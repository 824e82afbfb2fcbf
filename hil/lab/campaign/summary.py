"""What a campaign says about the checks: who is accused, by which check, from which severity on, and named as what."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from scipy.stats import binomtest

from hil.faults import CATALOGUE, parse_fault
from hil.lab.campaign.learning import accused, cause_of, diagnosed, judged
from hil.lab.campaign.trial import Outcome
from hil.verdict.reference import Reference
from hil.verdict.sight import Seen, Sight
from hil.verdict.signature import out_of_limits

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
    first: int
    """Hands on which the cause named first is right, of those found."""
    among_three: int
    furthest: float
    """Of the hands that were not found, the largest part of the way from healthy readings to a limit, 0 to 1."""


def detections(outcomes: Iterable[Outcome], reference: Reference) -> tuple[Detection, ...]:
    """Return a row for each fault and severity, in the order of the catalogue."""
    groups: dict[tuple[str, float], list[Outcome]] = defaultdict(list)
    for outcome in outcomes:
        if len(outcome.trial.faults) == 1 and outcome.ended != NOT_FIRED:
            fault = parse_fault(outcome.trial.faults[0])
            groups[fault.name, fault.severity].append(outcome)
    order = list(CATALOGUE)
    return tuple(
        _detection(name, severity, groups[name, severity], reference)
        for name, severity in sorted(groups, key=lambda key: (order.index(key[0]), _rank(*key)))
    )


def _detection(name: str, severity: float, group: Sequence[Outcome], reference: Reference) -> Detection:
    failed: dict[str, int] = defaultdict(int)
    found = first = among_three = 0
    furthest = 0.0
    for outcome in group:
        if not accused(outcome):
            furthest = max(furthest, *map(abs, judged(outcome).values()), 0.0)
            continue
        found += 1
        for check in {f"{key[0]}/{key[1]}" for key, excess in judged(outcome).items() if out_of_limits(excess)}:
            failed[check] += 1
        if outcome.stopped:
            failed[f"stopped: {outcome.ended or 'gate'}"] += 1
        causes = [cause.cause for cause in diagnosed(outcome, reference).causes[:3]]
        wanted = cause_of(parse_fault(outcome.trial.faults[0]))
        first += causes[:1] == [wanted]
        among_three += wanted in causes
    ranked = tuple(sorted(failed.items(), key=lambda item: (-item[1], item[0])))
    return Detection(
        name, severity, CATALOGUE[name].unit, Share(found, len(group)), ranked, first, among_three, furthest
    )


def false_alarms(outcomes: Iterable[Outcome]) -> tuple[Share, dict[str, int]]:
    """Return how many healthy hands are accused, and how often each check, `experiment/metric/subject`, did it."""
    healthy = [outcome for outcome in outcomes if not outcome.trial.faults]
    by_check: dict[str, int] = defaultdict(int)
    for outcome in healthy:
        for key, excess in judged(outcome).items():
            if out_of_limits(excess):
                by_check["/".join(key)] += 1
    return Share(sum(map(accused, healthy)), len(healthy)), dict(by_check)


def confusion(outcomes: Iterable[Outcome], reference: Reference) -> dict[tuple[str, str], int]:
    """Return how often a cause (first) was named as another (second)."""
    counts: dict[tuple[str, str], int] = defaultdict(int)
    for outcome in outcomes:
        if len(outcome.trial.faults) == 1 and outcome.ended != NOT_FIRED and accused(outcome):
            named = diagnosed(outcome, reference).causes
            if named:
                counts[cause_of(parse_fault(outcome.trial.faults[0])), named[0].cause] += 1
    return dict(counts)


def _rank(name: str, severity: float) -> float:
    """Return how severe a severity of a fault is; for some faults less is worse."""
    mild, _, severe = CATALOGUE[name].severities
    return severity if severe >= mild else -severity


def sights(outcomes: Sequence[Outcome]) -> dict[str, Sight]:
    """Return what each check, `experiment/metric`, can see: a fault counts that it found on every hand."""
    alarms: dict[str, int] = defaultdict(int)
    judged_hands: dict[str, int] = defaultdict(int)
    tried: dict[tuple[str, float], int] = defaultdict(int)
    found: dict[tuple[str, float], dict[str, int]] = defaultdict(lambda: defaultdict(int))
    for outcome in outcomes:
        excesses = judged(outcome)
        failing = {f"{key[0]}/{key[1]}" for key, excess in excesses.items() if out_of_limits(excess)}
        if not outcome.trial.faults:
            for check in {f"{key[0]}/{key[1]}" for key in excesses}:
                judged_hands[check] += 1
                alarms[check] += check in failing
        elif len(outcome.trial.faults) == 1 and outcome.ended != NOT_FIRED:
            fault = parse_fault(outcome.trial.faults[0])
            tried[fault.name, fault.severity] += 1
            for check in failing:
                found[fault.name, fault.severity][check] += 1
    seen: dict[str, dict[str, Seen]] = defaultdict(dict)
    for name, severity in sorted(tried, key=lambda key: _rank(*key), reverse=True):
        for check, count in found[name, severity].items():
            if count == tried[name, severity]:
                seen[check][name] = Seen(name, severity, CATALOGUE[name].unit, count)
    return {
        check: Sight(
            alarms[check],
            hands,
            Share(alarms[check], hands).interval[1],
            tuple(sorted(seen[check].values(), key=lambda item: item.fault)),
        )
        for check, hands in judged_hands.items()
    }
