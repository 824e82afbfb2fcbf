"""Score the shipped unit on the sixteen recorded runs: `python -m figures.calibration FOLDER`, for docs/calibration.md.

The runs are public logs that are not in this repository: run_00_*.npz to run_15_*.npz of the page's source.
"""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from figures import Rows, load, store
from hil.recordings.provenance import source_commit
from model.units.plausible import unit_named
from train.identification.replay_score import Errors, ReplayScore, score
from train.identification.trace import load_trace
from train.identification.trace_replay import replay
from train.identification.unit_parameters import PHASES_S

SCORED = "shipped `reference`, through every byte"
FULL_STEPS = (14, 15)
"""The runs at full steps; scores are also given without them."""


def positions(result: ReplayScore, readings: list[int]) -> str:
    """Return the error of positions over all phases, counts rms, of all runs and without those at full steps."""
    squares = np.array([np.mean(errors.counts**2) for _, errors in result.runs])
    kept = np.isin(np.arange(len(squares)), FULL_STEPS, invert=True)
    weights = np.array(readings)
    return " / ".join(f"{np.sqrt(np.average(squares[of], weights=weights[of])):.2f}" for of in (kept | True, kept))


def currents(result: ReplayScore) -> Rows:
    """Return the errors of currents by channel beside the hand's own, mA."""
    by_run = [_milliamperes(errors) for _, errors in result.runs]
    return [
        ("", *(channel.title for channel in Channel), "all"),
        *(
            (name, *(f"{value:.0f}" for value in values))
            for name, values in (
                ("all runs", _milliamperes(result.all_runs)),
                ("median of the runs", np.median(by_run, axis=0)),
                ("two runs, commanded alike", _milliamperes(result.repeats)),
            )
        ),
    ]


def _milliamperes(errors: Errors) -> NDArray[np.float64]:
    each = 1e3 * errors.currents_a
    return np.append(each, np.sqrt(np.nanmean(each**2)))


@click.command()
@click.argument("runs", type=click.Path(exists=True, file_okay=False, path_type=Path))
def main(runs: Path) -> None:
    """Score the shipped unit on RUNS, a folder with the sixteen recorded runs, and store the results."""
    traces, commit = [load_trace(path) for path in sorted(runs.glob("run_*.npz"))], source_commit()[:12]
    unit = unit_named("reference")
    # A recording does not contain its phase.
    replays = [[replay(trace, unit, phase_s=phase) for phase in PHASES_S] for trace in traces]
    result = score(traces, replays)
    row = [SCORED, positions(result, [len(trace.t_read) for trace in traces]), "", commit]
    origin = "sixteen recorded runs of one right hand"
    rows = [row if old[0] == SCORED else old for old in load("calibration.scores")["rows"]]
    store("calibration.scores", rows, origin=f"{origin}; commit {', '.join(sorted({old[-1] for old in rows[1:]}))}")
    store("calibration.currents", currents(result), origin=f"{origin}; commit {commit}")


if __name__ == "__main__":
    main()
