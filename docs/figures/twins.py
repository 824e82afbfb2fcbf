"""Fit twins of drawn hands by the command line: `python -m figures.twins FOLDER`, for docs/calibration.md.

A hand is recorded twice with different noise; the twin is fitted to one recording and scored on the other.
"""

from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

from figures import load, store
from hil.recordings.provenance import source_commit
from model.units.plausible import unit_named
from train.identification.trace import Trace, load_trace
from train.identification.trace_replay import replay
from train.identification.unit_parameters import PHASES_S, numbers

FITTED_TO = ("--excite", "all", "--seed", "1")
NEW = ("--excite", "all", "--scale", "0.7", "--seed", "2")


def best_rms(trace: Trace, name: str) -> float:
    """Return the error of a unit on a recording at its best phase of the telemetry grid, counts rms."""
    misses = [replay(trace, unit_named(name), phase_s=phase).counts - trace.counts for phase in PHASES_S]
    return min(_rms(miss) for miss in misses)


def _rms(miss: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(miss**2)))


def command(*words: str | Path) -> tuple[str, float]:
    """Run `aero-hil` with these words; return its output and its core-seconds."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    program = [Path(sys.executable).with_name("aero-hil"), *words]
    done = subprocess.run(program, capture_output=True, text=True, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return done.stdout, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def twin(unit: str, folder: Path) -> list[str]:
    """Record a drawn hand, fit its twin, and score both and `reference` on a new recording."""
    folder.mkdir(parents=True)
    fitted_to, new, fitted = (folder / name for name in ("fitted_to.mcap", "new.mcap", "twin.toml"))
    command("record", "--unit", unit, *FITTED_TO, "--out", fitted_to)
    command("record", "--unit", unit, *NEW, "--out", new)
    said, core_s = command("calibrate", fitted_to, "--out", fitted, "--jobs", "1")
    (folder / "calibrate.txt").write_text(said, encoding="utf-8")
    trace, known = load_trace(new), load_trace(fitted_to)
    errors = [f"{best_rms(of, name):.2f}" for of in (known, trace) for name in (unit, str(fitted), "reference")]
    true, found = (numbers(unit_named(name))["hand.cable_take_up"] for name in (unit, str(fitted)))
    far = 1e3 * np.abs(found - true).max()
    return [unit, *errors, f"{far:.2f}", "no" if "not arrived" in said else "yes", f"{core_s:.0f}"]


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--first", default=99200, help="Seed of the first drawn hand.")
@click.option("--hands", default=6, help="Number of hands.")
def main(folder: Path, first: int, hands: int) -> None:
    """Fit twins of drawn hands in FOLDER and store the table, after each hand."""
    rows = [load("calibration.twins")["rows"][0]]
    for seed in range(first, first + hands):
        rows.append(twin(f"plausible:{seed}", folder / str(seed)))
        store("calibration.twins", rows, origin=f"commit {source_commit()[:12]}")
        click.echo(" ".join(rows[-1]))


if __name__ == "__main__":
    main()
