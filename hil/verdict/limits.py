"""Limits as data, and the one function that compares measured numbers with them.

One TOML file in `hil/data/limits` for each kind of hand. A limit bounds one metric of one experiment on one or more
subjects (a channel, or `hand`) and says where the bound comes from. What it means when a metric is out of its bounds
stands with the experiment that measures it.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields, replace
from functools import cache
from importlib import resources
from typing import Any

from aero.firmware import VERSION_GROUPS
from hil.checks import CHECKS, Measured, Measuring
from hil.checks.shared.declaration import Check, Metric
from hil.checks.shared.experiment import reading
from hil.checks.shared.subjects import SUBJECTS
from hil.recordings.errors import UnusableFileError
from hil.verdict.findings import Finding, MissingReadingError, Why, Withheld

LIMITS = resources.files("hil") / "data" / "limits"
BEYOND_GIVEN = 3.0
"""Excess of a reading beyond a bound that is given, or at the end of its scale: there are no margins to count."""
NARROWEST = 0.05
"""Half the range of healthy readings is at least this part of the distance from them to the limit."""
REQUIRED = ("experiment", "metric", "subjects", "source")


@dataclass(frozen=True)
class Limit:
    """A bound on one metric."""

    experiment: str
    metric: str
    subjects: tuple[str, ...]
    source: str
    """Where the bound comes from."""
    at_least: float = -math.inf
    at_most: float = math.inf
    firmware: tuple[str, ...] = ()
    """Firmware versions it holds for; empty for all."""
    guarded: bool | None = None
    """Whether it holds for a hand that is guarded, and weaker at its stops, or for one that is not; None for both."""
    healthy: tuple[float, float] | None = None
    """Least and greatest reading of the healthy hands that it was computed from; None for a bound that is given."""

    def holds_for(self, firmware: str, *, guarded: bool) -> bool:
        """Return whether it is one for hands with a version of the firmware, or one like it, guarded or not."""
        alike = next((versions for versions in VERSION_GROUPS if firmware in versions), ())
        return (not self.firmware or not set(alike).isdisjoint(self.firmware)) and self.guarded in (None, guarded)

    def excess(self, value: float) -> float | None:
        """Return how far a reading lies beyond the healthy ones: 0 among them, 1 at the limit, negative below them.

        A side without a limit has nothing to exceed: 0. A reading beyond a given bound counts as `BEYOND_GIVEN`. One
        that could not be measured (NaN) lies nowhere: None.
        """
        # Counted as too high, it would accuse whatever part reads too high.
        if math.isnan(value):
            return None
        if self.healthy is None:
            above = BEYOND_GIVEN if value > self.at_most else 0.0
            return -BEYOND_GIVEN if value < self.at_least else above
        low, high = self.healthy
        if value > high:
            return (value - high) / (self.at_most - high)
        return (value - low) / (low - self.at_least) if value < low else 0.0

    def side(self, value: float) -> float:
        """Return where a reading lies among the healthy ones: 0 in their middle, 1 at the greatest, -1 at the least.

        0 for one that could not be measured, and where nobody has measured healthy hands.
        """
        if math.isnan(value) or self.healthy is None:
            return 0.0
        low, high = self.healthy
        margin = max(margin for margin in (self.at_most - high, low - self.at_least) if math.isfinite(margin))
        return (value - (low + high) / 2) / max((high - low) / 2, NARROWEST * margin)

    def text(self, unit: str) -> str:
        """The bound as people read it, for example `at most 0.9 mm` or `42 to 45.3 mm`."""
        if math.isinf(self.at_least):
            return f"at most {self.at_most:g} {unit}"
        if math.isinf(self.at_most):
            return f"at least {self.at_least:g} {unit}"
        return f"{self.at_least:g} to {self.at_most:g} {unit}"

    def judge(self, metric: Metric, subject: str, value: float) -> Finding:
        """Compare one value of a metric with the bound.

        A value that could not be measured (NaN) does not pass, nor does one at the end of its scale.
        """
        at_the_end = value >= metric.end_of_scale
        measured = metric.text(value) + (", at the end of the window" if at_the_end else "")
        advice = metric.advice(value, self.at_least, self.at_most)
        return Finding(
            check=self.metric,
            subject=subject,
            passed=self.at_least <= value <= self.at_most and not at_the_end,
            measured=measured,
            expected=metric.text(self.at_most) if metric.says else self.text(metric.unit),
            source=self.source,
            meaning=advice.meaning,
            remedy=advice.remedy,
            words=metric.words,
            experiment=self.experiment,
            excess=BEYOND_GIVEN if at_the_end else self.excess(value),
        )


def kinds() -> tuple[str, ...]:
    """Return the kinds of hand for which there are limits."""
    files = (entry.name for entry in LIMITS.iterdir())
    return tuple(sorted(name.removesuffix(".toml") for name in files if name.endswith(".toml")))


@cache
def load_limits(kind: str, firmware: str, *, guarded: bool = False) -> tuple[Limit, ...]:
    """Return the limits for one kind of hand and one firmware, guarded or not.

    A kind may extend another: its own limits then stand in place of the other's on the same metric of a subject, and
    are at least as wide, also where the other's were widened later.
    A bound that a check gives itself holds for every kind whose file says nothing else.

    Raises:
        ValueError: there is no such kind, or its file has a mistake; the message says which.
    """
    extends, limits = read_limits(kind)
    own = tuple(limit for limit in limits if limit.holds_for(firmware, guarded=guarded))
    if extends:
        extended = load_limits(extends, firmware, guarded=guarded)
        return tuple(_holding(limit, extended) for limit in own) + without(extended, own)
    given = tuple(limit for limit in given_limits() if limit.holds_for(firmware, guarded=guarded))
    return own + without(given, own)


def _holding(limit: Limit, extended: tuple[Limit, ...]) -> Limit:
    """Return a limit, and its healthy readings, moved out to hold those of another kind on the same metric."""
    same = [limit] + [
        other
        for other in extended
        if (other.experiment, other.metric) == (limit.experiment, limit.metric)
        and not set(other.subjects).isdisjoint(limit.subjects)
    ]
    healthy = [one.healthy for one in same if one.healthy is not None]
    return replace(
        limit,
        at_least=min(one.at_least for one in same),
        at_most=max(one.at_most for one in same),
        healthy=(min(low for low, _ in healthy), max(high for _, high in healthy)) if healthy else None,
    )


@cache
def given_limits() -> tuple[Limit, ...]:
    """Return the bounds that the checks give themselves, which hold for every kind of hand."""
    return tuple(given_limit(check) for check in CHECKS if check.given)


def given_limit(check: Check) -> Limit:
    """Return the limit of a check that gives its bound."""
    return Limit(
        check.experiment,
        check.metric,
        check.subjects,
        check.source,
        check.at_least,
        check.at_most,
        firmware=check.firmware,
    )


def read_limits(kind: str) -> tuple[str, tuple[Limit, ...]]:
    """Return the kind that a kind of hand extends, empty for none, and its own limits for all versions.

    Raises:
        ValueError: there is no such kind, or its file has a mistake; the message says which.
    """
    table = _table(kind)
    if unknown := sorted(table.keys() - {"extends", "limit", "provenance"}):
        raise ValueError(f"limits of {kind}: unknown {', '.join(unknown)}; known are extends, limit, provenance")
    return table.get("extends", ""), tuple(parse_limit(entry) for entry in table.get("limit", ()))


def read_provenance(kind: str) -> Mapping[str, Any]:
    """Return what made the limits of a kind of hand; tables within say what made an experiment's again, or widened all.

    Raises:
        ValueError: there is no such kind.
    """
    found: Mapping[str, Any] = _table(kind)["provenance"]
    return found


def _table(kind: str) -> dict[str, Any]:
    if kind not in kinds():
        raise UnusableFileError(f"there are no limits for {kind!r}; there are {', '.join(kinds())}")
    return tomllib.loads(LIMITS.joinpath(f"{kind}.toml").read_text(encoding="utf-8"))


def without(limits: tuple[Limit, ...], own: tuple[Limit, ...]) -> tuple[Limit, ...]:
    """Return `limits` less every subject for which `own` has a limit on the same metric."""
    taken = {(limit.experiment, limit.metric, subject) for limit in own for subject in limit.subjects}
    left = []
    for limit in limits:
        subjects = tuple(s for s in limit.subjects if (limit.experiment, limit.metric, s) not in taken)
        if subjects:
            left.append(replace(limit, subjects=subjects))
    return tuple(left)


def compare(
    measuring: Measuring,
    measured: Measured,
    limits: tuple[Limit, ...],
    late: Callable[[str, Metric], float],
    late_samples: Why | None = None,
) -> tuple[tuple[Finding, ...], tuple[Withheld, ...]]:
    """Compare what was measured in an experiment or a whole run, by subject and metric, with the limits for it.

    A number that is not there, because its samples came late, is not judged. One that is out of limits, and was taken
    while this computer was held up, is not judged either. One that the hand did not let be measured is NaN: it does not
    pass, and is on no side of its limits.

    Args:
        measuring: what measured it.
        measured: its readings.
        limits: of the hand.
        late: how long this computer was held up when a subject's reading was taken, s; 0 when it was not too long.
        late_samples: why samples of this recording may have come late; None where none can have.

    Raises:
        MissingReadingError: a reading is not there, and nothing excuses that.
    """
    found, withheld = list[Finding](), list[Withheld]()
    for limit in limits:
        for subject in limit.subjects if limit.experiment == measuring.name else ():
            metric, value = measuring.metric(limit.metric, subject), reading(measured, subject, limit.metric)
            seconds = late(subject, metric)
            finding = None if value is None else limit.judge(metric, subject, value)
            if finding is not None and (finding.passed or not seconds):
                found.append(finding)
            elif finding is None and metric.optional:
                continue
            elif seconds:
                withheld.append(Withheld(limit.experiment, limit.metric, subject, metric.words, Why.HELD_UP, seconds))
            elif late_samples is not None and metric.samples_in_time:
                withheld.append(Withheld(limit.experiment, limit.metric, subject, metric.words, late_samples))
            else:
                raise MissingReadingError(f"{limit.experiment} did not measure {limit.metric} of {subject}")
    return tuple(found), tuple(withheld)


Key = tuple[str, str, str]
"""Experiment, metric and subject."""


def out_of_limits(excess: float | None) -> bool:
    """Return whether a reading with this excess (`Limit.excess`) is known to be beyond its limit."""
    return excess is not None and abs(excess) > 1.0


def within_limits(excess: float | None) -> bool:
    """Return whether a reading with this excess (`Limit.excess`) is known to be within its limit."""
    return excess is not None and not out_of_limits(excess)


def excesses(numbers: Mapping[str, Measured], limits: Iterable[Limit]) -> dict[Key, float | None]:
    """Return the excess of every judged reading of a run, None of one that could not be measured (`Limit.excess`).

    What is not there is left out.
    """
    return {
        (limit.experiment, limit.metric, subject): limit.excess(value)
        for limit in limits
        for subject in limit.subjects
        if (value := reading(numbers.get(limit.experiment, {}), subject, limit.metric)) is not None
    }


def parse_limit(table: Mapping[str, Any]) -> Limit:
    """Make a limit of one table of a limits file.

    Raises:
        ValueError: a key is unknown or missing, or the bound is none.
    """
    unknown, missing = table.keys() - {field.name for field in fields(Limit)}, set(REQUIRED) - table.keys()
    if unknown or missing:
        raise ValueError(f"limit {dict(table)}: unknown keys {sorted(unknown)}, missing keys {sorted(missing)}")
    if not table["subjects"] or any(subject not in SUBJECTS for subject in table["subjects"]):
        raise ValueError(f"limit on {table['metric']}: subjects are some of {', '.join(SUBJECTS)}")
    sequences = {key: tuple(table[key]) for key in ("subjects", "firmware", "healthy") if key in table}
    limit = Limit(**{**table, **sequences})
    if not limit.at_least < limit.at_most or (math.isinf(limit.at_least) and math.isinf(limit.at_most)):
        raise ValueError(f"limit on {limit.metric}: give at_least, at_most, or both with at_least the lower")
    return limit
