"""Limits as data, and the one function that compares measured numbers with them.

`hil/data/limits.csv` has a row for each metric of an experiment, the subjects whose readings are alike (channels, or
`hand`) and the firmware; `hil/data/population.toml` says from which hands `aero-hil limits make` made it. A bound that
is given stands with its check.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources

from aero.firmware import VERSION_GROUPS
from hil.checks import CHECKS, Measured, Measuring
from hil.checks.shared.declaration import Metric
from hil.checks.shared.experiment import reading
from hil.checks.shared.subjects import SUBJECTS
from hil.verdict.findings import Finding, MissingReadingError, Why, Withheld

TABLE = resources.files("hil") / "data" / "limits.csv"
COLUMNS = (
    "experiment", "metric", "subjects", "firmware", "guarded", "healthy_from", "healthy_to", "at_least", "at_most",
    "readings",
)  # fmt: skip
GUARDED = {"": None, "no": False, "yes": True}
BEYOND_GIVEN = 3.0
"""Excess of a reading beyond a bound that is given, or at the end of its scale: there are no margins to count."""


@dataclass(frozen=True)
class Limit:
    """A bound on one metric."""

    experiment: str
    metric: str
    subjects: tuple[str, ...]
    at_least: float = -math.inf
    at_most: float = math.inf
    firmware: tuple[str, ...] = ()
    """Firmware versions it holds for; empty for all."""
    guarded: bool | None = None
    """Whether it holds for a hand that is guarded, and weaker at its stops, or for one that is not; None for both."""
    healthy: tuple[float, float] | None = None
    """Least and greatest reading of the healthy hands that it was computed from; None for a bound that is given."""
    readings: int = 0
    """Of healthy hands, that it was computed from."""
    given_by: str = ""
    """Where a bound that is given comes from."""

    @property
    def source(self) -> str:
        """Where the bound comes from."""
        return self.given_by or f"{self.readings} readings of healthy hands with such firmware"

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
        return Finding(
            check=self.metric,
            subject=subject,
            passed=self.at_least <= value <= self.at_most and not at_the_end,
            measured=measured,
            expected=metric.text(self.at_most) if metric.says else self.text(metric.unit),
            source=self.source,
            words=metric.words,
            experiment=self.experiment,
            excess=BEYOND_GIVEN if at_the_end else self.excess(value),
        )


@cache
def load_limits(firmware: str, *, guarded: bool = False) -> tuple[Limit, ...]:
    """Return the limits for hands with one firmware, guarded or not: those of the table, and those that checks give.

    Raises:
        ValueError: the table has a mistake; the message says which.
    """
    return tuple(limit for limit in (*_table(), *given_limits()) if limit.holds_for(firmware, guarded=guarded))


@cache
def _table() -> tuple[Limit, ...]:
    return parse_limits(TABLE.read_text(encoding="utf-8"))


def given_limits() -> tuple[Limit, ...]:
    """Return the bounds that the checks give themselves."""
    return tuple(
        Limit(
            check.experiment,
            check.metric,
            check.subjects,
            check.at_least,
            check.at_most,
            firmware=check.firmware,
            given_by=check.source,
        )
        for check in CHECKS
        if check.given
    )


def limits_text(limits: Iterable[Limit]) -> str:
    """Return computed limits as the CSV that `parse_limits` reads."""
    guards = {value: text for text, value in GUARDED.items()}
    lines = [",".join(COLUMNS)]
    for limit in limits:
        assert limit.healthy is not None
        bounds = (f"{bound:g}" if math.isfinite(bound) else "" for bound in (limit.at_least, limit.at_most))
        texts = (" ".join(limit.subjects), " ".join(limit.firmware), guards[limit.guarded])
        healthy = (f"{reading:.6g}" for reading in limit.healthy)
        lines.append(",".join((limit.experiment, limit.metric, *texts, *healthy, *bounds, str(limit.readings))))
    return "\n".join(lines) + "\n"


def parse_limits(text: str) -> tuple[Limit, ...]:
    """Return the limits of a table.

    Raises:
        ValueError: it has other columns, or a row has a mistake; the message names the row.
    """
    rows = csv.DictReader(text.splitlines())
    if tuple(rows.fieldnames or ()) != COLUMNS:
        raise ValueError(f"a table of limits has the columns {', '.join(COLUMNS)}, not {rows.fieldnames}")
    return tuple(_parse_row(row) for row in rows)


def _parse_row(row: Mapping[str, str]) -> Limit:
    try:
        limit = Limit(
            row["experiment"],
            row["metric"],
            tuple(row["subjects"].split()),
            float(row["at_least"] or -math.inf),
            float(row["at_most"] or math.inf),
            tuple(row["firmware"].split()),
            GUARDED[row["guarded"]],
            (float(row["healthy_from"]), float(row["healthy_to"])),
            int(row["readings"]),
        )
    except (LookupError, ValueError, TypeError, AttributeError) as error:
        raise ValueError(f"limit {dict(row)}: {error}") from error
    if not limit.subjects or not set(limit.subjects) <= set(SUBJECTS):
        raise ValueError(f"limit {dict(row)}: subjects are some of {', '.join(SUBJECTS)}")
    if not limit.at_least < limit.at_most:
        raise ValueError(f"limit {dict(row)}: at_least is the lower of two bounds")
    if math.isinf(limit.at_least) and math.isinf(limit.at_most):
        raise ValueError(f"limit {dict(row)}: give at_least, at_most, or both")
    return limit


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
