"""Checks: each folder here with a `checks.toml` is one.

In `check.py`, `run` moves a hand and records it, `measure` turns the recording into numbers, and the optional `details`
adds a table to the page. `checks.toml` defines each number (format: `shared/declaration.py`). A new check is a new
folder; it needs no registration. A check may have another plan, under `[plan.NAME]` and in `NAME.py`, which moves the
hand differently and measures some of the metrics. `session`, `driver` and `alike` have no `run`: they are measured on
the recordings of the whole run.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from importlib import import_module, resources
from importlib.resources.abc import Traversable
from typing import Any

from aero_hil_toml import filled, parsed
from hil.checks.shared.declaration import Metric, parse_metric
from hil.checks.shared.experiment import Experiment, Measured, Measuring, complete

OPTIONAL = {"details": "details", "RESOLUTION": "resolution"}
"""Optional names in `check.py`, and the fields that they fill."""


def _read(folder: Traversable) -> Iterator[Measuring]:
    table = parsed((folder / "checks.toml").read_text(encoding="utf-8"), f"{folder.name}/checks.toml")
    rows, plans = table.pop("metric"), table.pop("plan", {})
    name = folder.name
    yield _measuring(name, f"{name}.check", _metrics(name, rows), table)
    for plan, declared in plans.items():
        names = declared.pop("metrics", [row["name"] for row in rows])
        metrics = _metrics(plan, [row for row in rows if row["name"] in names])
        # The comparison with paper and baseline belongs to the main plan.
        bare = [replace(one, column=None, paper={}, published=(), worse=None, worst_at="") for one in metrics]
        yield _measuring(plan, f"{name}.{plan}", bare, declared)


def _metrics(name: str, rows: list[dict[str, Any]]) -> list[Metric]:
    return [metric for row in rows for metric in parse_metric(name, row)]


def _measuring(name: str, file: str, metrics: list[Metric], table: Mapping[str, Any]) -> Measuring:
    module = import_module(f"{__name__}.{file}")
    found = {"name": name, "metrics": metrics, "measure": module.measure, **table}
    found |= {key: getattr(module, name) for name, key in OPTIONAL.items() if hasattr(module, name)}
    if not hasattr(module, "run"):
        return filled(Measuring, found, f"check {name}")
    found |= {"run": module.run, "furthest": module.FURTHEST, "measure": complete(module.measure)}
    return filled(Experiment, found, f"check {name}")


_FOLDERS = [folder for folder in resources.files(__name__).iterdir() if (folder / "checks.toml").is_file()]
_FOUND = [found for folder in _FOLDERS for found in _read(folder)]
EXPERIMENTS: dict[str, Experiment] = {
    found.name: found
    for found in sorted((found for found in _FOUND if isinstance(found, Experiment)), key=lambda found: found.rank)
}
DEFAULT = tuple(name for name, experiment in EXPERIMENTS.items() if experiment.by_default)
"""Experiments of a run without a selection."""
_WHOLE = {found.name: found for found in _FOUND if not isinstance(found, Experiment)}
WHOLE_RUN = _WHOLE["session"]
"""Check of all bytes since the hand was opened."""
DRIVER = _WHOLE["driver"]
"""Check of each experiment's recording; the worst result counts."""
ALIKE = _WHOLE["alike"]
"""Check of the readings of all experiments together."""
JUDGED: dict[str, Measuring] = {**EXPERIMENTS, **{found.name: found for found in (WHOLE_RUN, DRIVER, ALIKE)}}
"""Everything with limits: the experiments, and the checks of the whole run."""
BOUNDS = tuple(bound for found in JUDGED.values() for metric in found.metrics for bound in metric.bounds)
"""All bounds, in the order of the limits."""


def metric_of(experiment: str, name: str, subject: str) -> Metric | None:
    """Return a metric of a check on a subject, or None, also for what is no check."""
    metrics = JUDGED[experiment].metrics if experiment in JUDGED else ()
    return next((one for one in metrics if one.name == name and subject in one.subjects), None)


__all__ = [
    "ALIKE",
    "BOUNDS",
    "DEFAULT",
    "DRIVER",
    "EXPERIMENTS",
    "JUDGED",
    "WHOLE_RUN",
    "Experiment",
    "Measured",
    "Measuring",
    "metric_of",
]
