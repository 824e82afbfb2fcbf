"""Tables of docs/calibration.md; `python -m figures.calibration FOLDER` scores the unit on the sixteen recorded runs.

The runs are public logs that are not in this repository: run_00_*.npz to run_15_*.npz of the page's source.
"""

from __future__ import annotations

import json
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

from aero.whole_file import write_whole
from figures.cells import Cell
from figures.intervals import coverage, twins
from figures.sources import Row
from figures.stored import Result, folder, stored
from hil.lab.system_identification.search import pooled_rms
from hil.lab.system_identification.trace import load_trace
from hil.lab.system_identification.unit_parameters import UnitModel
from hil.recordings.provenance import source_commit
from model.units.naming import unit_named

SCORED = "shipped `reference`, through every byte"
FULL_STEPS = (14, 15)
"""The runs at full steps; scores are also given without them."""
COLUMNS = {
    "fitted": "fitted to all, any phase",
    "best": "fitted to all, best phase",
    "held_out": "left out, any phase",
    "held_out_best": "left out, best phase",
}


def scores(result: Result) -> list[Row]:
    """Counts rms of each model, of all runs and without those at full steps."""
    return [
        ("model", *COLUMNS.values(), "commit"),
        *(
            (
                row["model"],
                *(Cell.of("{:.2f} / {:.2f}", *row[key]) if key in row else "" for key in COLUMNS),
                row["commit"],
            )
            for row in result.rows
        ),
    ]


def scored(runs: Path) -> dict[str, list[float]]:
    """Score the shipped unit on the recorded runs: counts rms pooled over runs, readings, channels and phases."""
    traces = tuple(load_trace(path) for path in sorted(runs.glob("run_*.npz")))
    model = UnitModel(unit_named("reference"), traces, "0.2.0", None, ())
    nothing, n = np.zeros(0), len(traces)
    by_phase = [model.residuals([nothing] * n, [phase] * n) for phase in model.phases_s]
    best = [min(some, key=_square) for some in zip(*by_phase, strict=True)]
    kept = [run for run in range(n) if run not in FULL_STEPS]
    return {
        "fitted": [pooled_rms(some[run] for some in by_phase for run in chosen) for chosen in (range(n), kept)],
        "best": [pooled_rms(best[run] for run in chosen) for chosen in (range(n), kept)],
    }


def _square(residuals: NDArray[np.float64]) -> float:
    return float(np.mean(residuals**2))


@click.command()
@click.argument("runs", type=click.Path(exists=True, file_okay=False, path_type=Path))
def main(runs: Path) -> None:
    """Score the shipped unit on RUNS, a folder with the sixteen recorded runs, and keep the result."""
    path = folder() / "calibration.json"
    table = json.loads(path.read_text(encoding="utf-8"))
    row = next(row for row in table["rows"] if row["model"] == SCORED)
    row |= {key: [round(score, 4) for score in pair] for key, pair in scored(runs).items()}
    row["commit"] = source_commit()[:12]
    table["provenance"]["commit"] = ", ".join(sorted({row["commit"] for row in table["rows"]}))
    write_whole(path, json.dumps(table, indent=1) + "\n")


TABLES = {
    "scores": stored("calibration", scores),
    "intervals": stored("intervals", coverage),
    "twins": stored("intervals", twins),
}

if __name__ == "__main__":
    main()
