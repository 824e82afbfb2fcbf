"""Checks: each folder here with a `checks.toml` is one.

In `check.py`, `run` moves a hand and records it, `measure` turns the recording into numbers, and the optional `details`
adds a table to the page. `checks.toml` defines each number (format: `shared/declaration.py`). A new check is a new
folder; it needs no registration. A check may have another plan, under `[plan.NAME]` and in `NAME.py`, which moves the
hand differently and measures some of the metrics. `session`, `driver` and `alike` have no `run`: they are measured on
the recordings of the whole run.

A check of another package is such a folder too, with an `__init__.py`: its entry point in the group
`aero_hil.experiments` names it. The variable `AERO_HIL_EXPERIMENTS` lists folders that are not installed.
"""

import os
import sys
from collections.abc import Iterator, Mapping
from dataclasses import replace
from importlib import import_module, resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from aero_hil_toml import filled, parsed
from hil.checks.shared.declaration import Metric, parse_metric
from hil.checks.shared.experiment import Experiment, Measured, Measuring, complete
from hil.targets.brought import points_of

GROUP, VARIABLE = "aero_hil.experiments", "AERO_HIL_EXPERIMENTS"
"""Group of entry points, and environment variable with paths, of other people's checks."""
OPTIONAL = {"details": "details", "RESOLUTION": "resolution"}
"""Optional names in `check.py`, and the fields that they fill."""


def _read(folder: Traversable, package: str) -> Iterator[Measuring]:
    """Yield the check of a folder and its other plans; `package` is the folder's module."""
    table = parsed((folder / "checks.toml").read_text(encoding="utf-8"), f"{folder.name}/checks.toml")
    rows, plans = table.pop("metric"), table.pop("plan", {})
    name = folder.name
    yield _measuring(name, f"{package}.check", _metrics(name, rows), table)
    for plan, declared in plans.items():
        names = declared.pop("metrics", [row["name"] for row in rows])
        metrics = _metrics(plan, [row for row in rows if row["name"] in names])
        # The comparison with paper and baseline belongs to the main plan.
        bare = [replace(one, column=None, paper={}, published=(), worse=None, worst_at="") for one in metrics]
        yield _measuring(plan, f"{package}.{plan}", bare, declared)


def _metrics(name: str, rows: list[dict[str, Any]]) -> list[Metric]:
    return [metric for row in rows for metric in parse_metric(name, row)]


def _measuring(name: str, module_name: str, metrics: list[Metric], table: Mapping[str, Any]) -> Measuring:
    module = import_module(module_name)
    found = {"name": name, "metrics": metrics, "measure": module.measure, **table}
    found |= {key: getattr(module, name) for name, key in OPTIONAL.items() if hasattr(module, name)}
    if not hasattr(module, "run"):
        return filled(Measuring, found, f"check {name}")
    found |= {"run": module.run, "furthest": module.FURTHEST, "measure": complete(module.measure)}
    return filled(Experiment, found, f"check {name}")


def _of_others() -> Iterator[str]:
    """Yield the modules of other packages' checks, then those of the folders of the environment variable."""
    yield from (point.value for _, point in points_of(GROUP))
    for text in filter(None, os.environ.get(VARIABLE, "").split(os.pathsep)):
        folder = Path(text).resolve()
        sys.path.append(str(folder.parent))
        yield folder.name


def _all() -> Iterator[Measuring]:
    """Yield our checks, then others'; one that is broken or has a name of ours is left out, see `LOSSES`."""
    names: set[str] = set()
    for folder in resources.files(__name__).iterdir():
        if (folder / "checks.toml").is_file():
            for found in _read(folder, f"{__name__}.{folder.name}"):
                names.add(found.name)
                yield found
    for package in _of_others():
        try:
            others = [*_read(resources.files(package), package)]
            if taken := names.intersection(found.name for found in others):
                raise ValueError(f"there is a check {', '.join(taken)} already")
        except (ImportError, OSError, ValueError, KeyError, AttributeError) as error:
            LOSSES.append(f"the experiment {package} is left out: {error}")
        else:
            names |= {found.name for found in others}
            yield from others


LOSSES: list[str] = []
"""One line for each check of others that cannot be used."""
_FOUND = [*_all()]
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
    "LOSSES",
    "WHOLE_RUN",
    "Experiment",
    "Measured",
    "Measuring",
    "metric_of",
]
