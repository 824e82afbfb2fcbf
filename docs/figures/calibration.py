"""Score the shipped unit on the sixteen recorded runs: `python -m figures.calibration FOLDER`, for docs/calibration.md.

The runs are public logs that are not in this repository: run_00_*.npz to run_15_*.npz of the page's source.
"""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

from figures import load, store
from hil.lab.system_identification.search import pooled_rms
from hil.lab.system_identification.trace import load_trace
from hil.lab.system_identification.unit_parameters import UnitModel
from hil.recordings.provenance import source_commit
from model.units.naming import unit_named

SCORED = "shipped `reference`, through every byte"
FULL_STEPS = (14, 15)
"""The runs at full steps; scores are also given without them."""


def scored(runs: Path) -> tuple[list[float], list[float]]:
    """Score the shipped unit on the recorded runs: counts rms of all runs and without those at full steps.

    Over any telemetry phase, and over the best of each run.
    """
    traces = tuple(load_trace(path) for path in sorted(runs.glob("run_*.npz")))
    model = UnitModel(unit_named("reference"), traces, "0.2.0", None, ())
    nothing, n = np.zeros(0), len(traces)
    by_phase = [model.residuals([nothing] * n, [phase] * n) for phase in model.phases_s]
    best = [min(some, key=_square) for some in zip(*by_phase, strict=True)]
    kept = [run for run in range(n) if run not in FULL_STEPS]
    return (
        [pooled_rms(some[run] for some in by_phase for run in chosen) for chosen in (range(n), kept)],
        [pooled_rms(best[run] for run in chosen) for chosen in (range(n), kept)],
    )


def _square(residuals: NDArray[np.float64]) -> float:
    return float(np.mean(residuals**2))


@click.command()
@click.argument("runs", type=click.Path(exists=True, file_okay=False, path_type=Path))
def main(runs: Path) -> None:
    """Score the shipped unit on RUNS, a folder with the sixteen recorded runs, and store the result."""
    scores = (f"{both:.2f} / {without:.2f}" for both, without in scored(runs))
    row = [SCORED, *scores, "", "", source_commit()[:12]]
    store("calibration.scores", [row if old[0] == SCORED else old for old in load("calibration.scores")["rows"]])


if __name__ == "__main__":
    main()
