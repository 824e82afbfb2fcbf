"""Limits as data, and the comparison of readings with limits.

`hil/data/limits.csv` has a row for each metric of an experiment, subjects with like readings (channels, or `hand`) and
firmware; `hil/data/population.toml` names the hands that `python -m train.limits` used. Fixed bounds are in the check's
own `checks.toml`.
"""

import csv
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources

from aero.firmware import VERSION_GROUPS
from hil.checks import BOUNDS, Measured, Measuring
from hil.checks.shared.declaration import Metric
from hil.checks.shared.experiment import reading
from hil.checks.shared.subjects import SUBJECTS
from hil.verdict.findings import Finding, MissingReadingError, NotJudgedReason, Withheld

TABLE = resources.files("hil") / "data" / "limits.csv"
COLUMNS = (
    "experiment", "metric", "subjects", "firmware", "guarded", "healthy_from", "healthy_to", "at_least", "at_most",
    "readings",
)  # fmt: skip
GUARDED = {"": None, "no": False, "yes": True}
BEYOND_GIVEN = 3.0
"""Excess of a reading beyond a fixed bound or at the end of its scale, where no margin is defined."""


@dataclass(frozen=True)
class Limit:
    """Bound on one metric."""

    experiment: str
    metric: str
    subjects: tuple[str, ...]
    at_least: float = -math.inf
    at_most: float = math.inf
    firmware: tuple[str, ...] = ()
    """Firmware versions of the bound; empty for all."""
    guarded: bool | None = None
    """Whether the bound is for guarded hands (weaker at their stops) or unguarded ones; None for both."""
    healthy: tuple[float, float] | None = None
    """Range of the healthy readings behind the bound; None for a fixed bound."""
    readings: int = 0
    given_by: str = ""
    """Source of a fixed bound."""

    @property
    def source(self) -> str:
        """Source of the bound."""
        return self.given_by or f"{self.readings} readings of healthy hands with such firmware"

    def holds_for(self, firmware: str, *, guarded: bool) -> bool:
        """Return whether the limit applies to this firmware (or one of its version group) and guard state."""
        alike = next((versions for versions in VERSION_GROUPS if firmware in versions), ())
        return (not self.firmware or not set(alike).isdisjoint(self.firmware)) and self.guarded in (None, guarded)

    def excess(self, value: float) -> float | None:
        """Return the excess of a reading: 0 within the healthy range, 1 at the limit, negative below the range.

        A side without a limit gives 0; a reading beyond a fixed bound gives `BEYOND_GIVEN`. An unmeasurable reading
        (NaN) gives None.
        """
        # Any number here would make an unmeasurable reading evidence against a part.
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
        """Return the bound as text, for example `at most 0.9 mm` or `42 to 45.3 mm`."""
        if math.isinf(self.at_least):
            return f"at most {self.at_most:g} {unit}"
        if math.isinf(self.at_most):
            return f"at least {self.at_least:g} {unit}"
        return f"{self.at_least:g} to {self.at_most:g} {unit}"

    def judge(self, metric: Metric, subject: str, value: float) -> Finding:
        """Compare one value of a metric with the bound.

        An unmeasurable value (NaN) and one at the end of its scale fail.
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
    """Return the limits for a firmware and guard state: those of the table and the fixed bounds of checks.

    Raises:
        ValueError: the table is invalid; the message names the mistake.
    """
    return tuple(limit for limit in (*_table(), *given_limits()) if limit.holds_for(firmware, guarded=guarded))


@cache
def _table() -> tuple[Limit, ...]:
    return parse_limits(TABLE.read_text(encoding="utf-8"))


def given_limits() -> tuple[Limit, ...]:
    """Return the fixed bounds of the checks."""
    return tuple(
        Limit(
            bound.experiment,
            bound.metric,
            bound.subjects,
            bound.at_least,
            bound.at_most,
            firmware=bound.firmware,
            given_by=bound.source,
        )
        for bound in BOUNDS
        if bound.given
    )


def limits_text(limits: Iterable[Limit]) -> str:
    """Return computed limits as CSV text for `parse_limits`."""
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
    """Return the limits of a CSV table.

    Raises:
        ValueError: wrong columns or an invalid row; the message names the row.
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
    late_samples: NotJudgedReason | None = None,
) -> tuple[tuple[Finding, ...], tuple[Withheld, ...]]:
    """Compare the readings of an experiment or a whole run with their limits.

    Not judged are readings that are missing because of late samples, and readings out of limits during a scheduling
    delay of this computer. An unmeasurable reading (NaN) fails, without a direction.

    Args:
        measuring: experiment or check of the readings.
        measured: readings by subject and metric.
        limits: limits of the hand.
        late: returns the scheduling delay of this computer during a subject's metric, s; 0 if tolerable.
        late_samples: reason for late samples in this recording; None if all were on time.

    Raises:
        MissingReadingError: a reading is missing without an excuse.
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
                withheld.append(
                    Withheld(limit.experiment, limit.metric, subject, metric.words, NotJudgedReason.HELD_UP, seconds)
                )
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
    """Return the excess of every present reading of a run (`Limit.excess`); None for unmeasurable ones."""
    return {
        (limit.experiment, limit.metric, subject): limit.excess(value)
        for limit in limits
        for subject in limit.subjects
        if (value := reading(numbers.get(limit.experiment, {}), subject, limit.metric)) is not None
    }
