"""The experiments: each file or folder here that defines `EXPERIMENT` is one, `shared` holds what they share.

A new experiment is a new file; nothing else has to know it. Its limits stand in `hil/data/limits`.
"""

from importlib import import_module
from pkgutil import iter_modules

from hil.checks.session import WHOLE_RUN
from hil.checks.shared.experiment import Experiment, Measured, Measuring, Metric, metric_of


def _found() -> list[Experiment]:
    modules = (import_module(f"{__name__}.{module.name}") for module in iter_modules(__path__))
    return [module.EXPERIMENT for module in modules if hasattr(module, "EXPERIMENT")]


EXPERIMENTS: dict[str, Experiment] = {
    experiment.name: experiment for experiment in sorted(_found(), key=lambda experiment: experiment.rank)
}
"""By name, in the order in which a hand goes through them."""
DEFAULT = tuple(name for name, experiment in EXPERIMENTS.items() if experiment.by_default)
"""Run unless others are asked for."""

JUDGED: dict[str, Measuring] = {**EXPERIMENTS, WHOLE_RUN.name: WHOLE_RUN}
"""Everything that limits can be set on: the experiments, and the run as a whole."""

__all__ = [
    "DEFAULT",
    "EXPERIMENTS",
    "JUDGED",
    "WHOLE_RUN",
    "Experiment",
    "Measured",
    "Measuring",
    "Metric",
    "metric_of",
]
