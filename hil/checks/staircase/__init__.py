"""The paper's dynamic validation: simulator and hand on one staircase, and every number that is read off it.

`stimulus` drives both; `metrics` says what is measured and what it means. The numbers come from `tracking` (with
`settled` and `rise_time`) and `cable_loads`; `residual_sources` takes a residual apart for the report.
"""

from hil.checks.shared.experiment import Experiment
from hil.checks.staircase.metrics import METRICS, measure
from hil.checks.staircase.stimulus import run

EXPERIMENT = Experiment(
    "staircase",
    "Simulator and hand on one command stream",
    run,
    measure,
    (1.0,) * 7,
    METRICS,
    rank=70,
    pushes_at_stops=True,
)
