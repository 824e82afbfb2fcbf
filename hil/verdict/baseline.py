"""Stored figures of one hand and their comparison with a later run."""

import math
import os
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from aero.regular_file import read_json
from hil.checks import JUDGED, Measured
from hil.checks.shared.declaration import Metric
from hil.recordings.errors import UnusableFileError, writing
from hil.recordings.recording import Header
from hil.verdict.findings import Finding

LARGEST_BYTES = 16 * 2**20
"""Size limit of a run's figures, bytes; a run has some ten thousand figures."""
LARGEST = 1e12
"""Limit of a figure; units are SI, millimetres and counts."""
FIELDS = {"hand", "passed", "not_run", "counts", "measured", "findings", "diagnosis", "withheld"}
"""Fields of `checks.json`."""


SAME = ("side", "firmware", "unit", "hand_id")
"""Header fields that identify the hand of a baseline and a run; an empty field is unknown."""


@dataclass(frozen=True)
class Baseline:
    """Earlier figures of one hand."""

    where: str
    hand: Mapping[str, str]
    """Identity of the hand, with the commit that measured it: see `described`."""
    measured: Mapping[str, Measured]

    def require_same(self, now: Mapping[str, str]) -> None:
        """Raise unless a hand matches the baseline's in the fields of `SAME`.

        Raises:
            UnusableFileError: another hand; the message names the field that differs.
        """
        for name in SAME:
            then = self.hand[name]
            if then and now[name] and not _ends_alike(then, now[name]):
                what = name.replace("_", " ")
                raise UnusableFileError(
                    f"the baseline {self.where} is of another hand: {what} {then}, this is {now[name]}"
                )

    @property
    def source(self) -> str:
        """Source of the expectation in a comparison with this baseline."""
        return f"baseline {self.where}, commit {self.hand.get('commit') or 'not known'}"


def _ends_alike(one: str, other: str) -> bool:
    """Return whether two texts are equal, or paths of which one ends with the other, as those of a unit file may."""
    first, second = Path(one).parts, Path(other).parts
    count = min(len(first), len(second))
    return one == other or (one.endswith(".toml") and first[-count:] == second[-count:])


def described(header: Header) -> dict[str, str]:
    """Return the identity of a header's hand, and the commit that measured it."""
    return {name: str(getattr(header, name)) for name in (*SAME, "commit")}


def store(results: Path, baseline: Path, *, force: bool = False) -> None:
    """Copy the figures and recordings of a run of `aero-hil validate` into a new folder.

    Args:
        results: folder of the run.
        baseline: folder to create.
        force: True to accept a run that did not pass.

    Raises:
        FileNotFoundError: `results` has no `checks.json`.
        FileExistsError: the folder exists already; a baseline is never overwritten.
        UnusableFileError: `results` is not a run, does not identify its hand, or did not pass.
        CannotBeWrittenError: the folder cannot be written; an incomplete one is removed.
    """
    if not (results / "checks.json").is_file():
        raise FileNotFoundError(f"{results} holds no checks.json; give the folder that `aero-hil validate --out` wrote")
    load(results)
    if not _checks(results).get("passed") and not force:
        raise UnusableFileError(
            f"the run in {results} did not pass, so an equally bad hand would pass later; --force stores it"
        )
    if baseline.exists():
        raise FileExistsError(f"{baseline} exists already; remove it or choose another name")
    draft = baseline.with_name(f".{os.getpid()}.{baseline.name}")
    try:
        with writing(baseline):
            draft.mkdir(parents=True)
            for path in (results / "checks.json", *sorted(results.glob("*.mcap"))):
                shutil.copy2(path, draft / path.name)
            draft.rename(baseline)
    except BaseException:
        shutil.rmtree(draft, ignore_errors=True)
        raise


def load(baseline: Path) -> Baseline:
    """Return the earlier figures of a hand.

    Raises:
        UnusableFileError: the folder is not a baseline, is damaged, or does not identify its hand.
    """
    try:
        checks = _checks(baseline)
        if unknown := sorted(checks.keys() - FIELDS):
            raise ValueError(f"unknown {', '.join(unknown)}")
        measured = {
            experiment: {
                subject: {metric: value for metric, value in row.items() if _is_figure(metric, value)}
                for subject, row in rows.items()
            }
            for experiment, rows in checks["measured"].items()
        }
        hand = checks.get("hand", {})
        if not all(isinstance(hand[name], str) for name in SAME):
            raise TypeError("the description of its hand is not text")
    except KeyError as error:
        raise UnusableFileError(f"{baseline} is not a baseline with the identity of its hand: no {error}") from error
    except (OSError, LookupError, TypeError, AttributeError, ValueError, RecursionError) as error:
        raise UnusableFileError(f"{baseline} is not a baseline of `aero-hil baseline`: {error}") from error
    return Baseline(str(baseline), hand, measured)


def _checks(folder: Path) -> Mapping[str, Any]:
    checks: Mapping[str, Any] = read_json(folder / "checks.json", LARGEST_BYTES)
    return checks


def _is_figure(metric: str, value: object) -> bool:
    """Return whether a metric has a value; null marks an unmeasurable one."""
    if not (value is None or isinstance(value, (int, float, str))) or isinstance(value, bool):
        raise TypeError(f"{metric} is {value!r}, not a number")
    if isinstance(value, (int, float)) and not abs(value) <= LARGEST:
        raise ValueError(f"{metric} is {value:.4}" if isinstance(value, float) else f"{metric} is too large a number")
    return isinstance(value, (int, float))


def regressions(before: Baseline, now: Mapping[str, Measured]) -> tuple[Finding, ...]:
    """Compare a run with a baseline, metric by metric where both have a value.

    Each allowance is far above the spread of the emulated hand over seeds, to cover a day's temperature changes of a
    physical hand.
    """
    return tuple(
        _judge(metric, subject, (then, float(now[name][subject][metric.name])), before)
        for name, measuring in JUDGED.items()
        for metric in measuring.metrics
        for subject in metric.subjects
        if metric.worse is not None
        and metric.name in now.get(name, {}).get(subject, {})
        and (then := before.measured.get(name, {}).get(subject, {}).get(metric.name)) is not None
    )


def _judge(metric: Metric, subject: str, values: tuple[float, float], before: Baseline) -> Finding:
    (then, value), worse = values, metric.worse
    assert worse is not None
    allowed = abs(then) + max(worse.by, worse.share * abs(then))
    known = math.isfinite(value)
    return Finding(
        check=f"{metric.name} against the baseline",
        subject=subject,
        passed=abs(value) <= allowed,
        measured=f"{f'{value:.4g} {metric.unit}' if known else 'not measurable'}, was {then:.4g}",
        expected=f"at most {allowed:.4g}",
        source=before.source,
        words=f"{metric.words} against the baseline",
        excess=0.0 if known else None,
    )
