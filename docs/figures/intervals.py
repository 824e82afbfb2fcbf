"""Do the intervals of a calibration hold? Measured on emulated hands whose numbers are known.

`python -m figures.intervals measure --out FILE` records and calibrates one hand after another as an owner would, and
adds a line a hand to FILE; hands that are there are left out. `factors FILE` writes `hil/data/interval_factors.toml`
from such lines that were made with `--plain`, `keep FILE` the stored result of docs/calibration.md from others.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import click
import numpy as np

from aero.whole_file import write_whole
from figures import ROOT, Rows, store
from hil.recordings.provenance import source_commit
from hil.recordings.recorder import Recorder
from hil.targets.opening import open_target
from model.units import Unit
from model.units.naming import unit_named
from train.identification.calibration import calibrate
from train.identification.excitation import EXPERIMENT, MOTIONS, excitation, play
from train.identification.search import Floats, pooled_rms
from train.identification.trace import Trace
from train.identification.trace_replay import replay
from train.identification.uncertainty import COVERAGE_SIGMA, FILE, Intervals
from train.identification.unit_file import unit_toml
from train.identification.unit_parameters import numbers

PLAIN = {"servos": 1.0, "hand": 1.0}
"""Factors that leave intervals as they are."""
FITTED_SCALE, LEFT_OUT_SCALE = 0.8, 0.6
"""Scales of the recording that a hand is fitted to, and of the ramps that it is not fitted to."""
PHASES_S = np.arange(0.0, 0.010, 0.001)
"""Telemetry phases on which what was left out is replayed."""
COVERED = 0.95
"""Share of the numbers of a kind that their intervals hold."""
ENOUGH = 19
"""Numbers of a kind from which on the 95 % factor of that kind is known by itself: the largest of 19 holds 19 of 20."""


def deviations(values: Mapping[str, Floats], truth: Mapping[str, Floats], known: Intervals) -> dict[str, Floats]:
    """Return how far off each fitted number is in standard deviations of its interval, arrays by `section.field`.

    Args:
        values: fitted numbers.
        truth: what they are.
        known: 95 % intervals of the fitted numbers; entries without width are left out.
    """
    found = {}
    for name, (low, high) in known.items():
        fitted = (low < high) & (values[name] != 0.0)
        value, above, true = values[name][fitted], high[fitted], truth[name][fitted]
        if not name.endswith("take_up"):
            value, above, true = (np.log(np.abs(one)) for one in (value, above, true))
        found[name] = COVERAGE_SIGMA * np.abs(true - value) / np.abs(above - value)
    return found


def conformal_factor(off: Sequence[float]) -> float:
    """Return the factor with which intervals hold a further number in 95 of 100 cases, from what some were off by.

    Split conformal prediction: the k-th smallest of n, k = 0.95 (n + 1) rounded up, or the largest where n is too
    small for that. A factor below one is one.

    Args:
        off: standard deviations that numbers of one kind were off by.
    """
    k = min(math.ceil(COVERED * (len(off) + 1)), len(off))
    return max(1.0, float(np.sort(off)[k - 1]) / COVERAGE_SIGMA)


def recorded(hand: str, motion: str, scale: float, seed: int) -> Trace:
    """Record one motion of one emulated hand."""
    with open_target("emulated", unit=hand, seed=seed) as target:
        recorder = Recorder(target, EXPERIMENT)
        play(target, recorder, excitation(motion, scale=scale))
        return Trace.from_recording(recorder.finish(), motion)


def calibrated(
    hand: str, motion: str, seed: int, *, plain: bool, jobs: int = 1, twins: Path | None = None
) -> dict[str, Any]:
    """Record and calibrate one hand, write its twin into a folder, and return how far off its numbers are by kind."""
    began = time.process_time()
    trace = recorded(hand, motion, FITTED_SCALE, seed)
    result = calibrate([trace], unit_named("reference"), leave_out=False, factors=PLAIN if plain else None, jobs=jobs)
    if twins is not None:
        text = unit_toml(result.unit, f"Fitted to {trace.name} of {hand}", result.intervals, result.told)
        write_whole(twins / f"{hand.partition(':')[2]}.toml", text)
    off = deviations(numbers(result.unit), numbers(unit_named(hand)), result.intervals)
    return {
        "hand": hand,
        "motion": motion,
        "plain": plain,
        "commit": source_commit(),
        "processor_s": round(time.process_time() - began),
        "fitted_rms": round(pooled_rms(result.found.residuals), 3),
        "left_out_rms": round(left_out_rms(hand, result.unit, seed + 1), 3),
        "off": {name: [round(float(one), 3) for one in values] for name, values in off.items()},
    }


def left_out_rms(hand: str, twin: Unit, seed: int) -> float:
    """Return a twin's error on ramps that it was not fitted to, counts rms, on their best telemetry phase."""
    trace = recorded(hand, "ramps", LEFT_OUT_SCALE, seed)
    return min(
        pooled_rms([replay(trace, twin, phase_s=phase, currents=False).counts - trace.counts]) for phase in PHASES_S
    )


def pooled(lines: Iterable[dict[str, Any]]) -> dict[str, list[float]]:
    """Return how far off the numbers of some hands are by kind: a field of the hand, or any of the servos'."""
    kinds: dict[str, list[float]] = {}
    for line in lines:
        for name, off in line["off"].items():
            kinds.setdefault("servos" if name.startswith("servos") else name, []).extend(off)
    return kinds


def coverage(lines: Iterable[dict[str, Any]]) -> Rows:
    """Numbers in their 95 % intervals by kind, and of all."""
    kinds = pooled(lines)
    kinds["all"] = [one for off in kinds.values() for one in off]
    inside = {name: sum(one <= COVERAGE_SIGMA for one in off) for name, off in kinds.items()}
    rows = [[f"`{name}`", str(inside[name]), str(len(off))] for name, off in kinds.items()]
    return [["number", "in their intervals", "of"], *rows]


def twins(lines: Iterable[dict[str, Any]]) -> Rows:
    """Error of each twin on the recording that it was fitted to and on one that it was not."""
    rows = [[f"`{row['hand']}`", f"{row['fitted_rms']:.2f}", f"{row['left_out_rms']:.2f}"] for row in lines]
    return [["hand", "fitted, counts rms", "not fitted, counts rms"], *rows]


def _lines(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()] if path.exists() else []


FILES = click.argument("measured", type=click.Path(exists=True, dir_okay=False, path_type=Path))


@click.group()
def main() -> None:
    """Measure whether intervals hold."""


@main.command()
@click.option("--first-seed", default=95000, show_default=True)
@click.option("--hands", default=12, show_default=True)
@click.option("--motion", type=click.Choice([*MOTIONS, "all"]), default="all", show_default=True)
@click.option("--plain", is_flag=True, help="Without the shipped factors, to compute them.")
@click.option("--jobs", default=1, show_default=True, help="Processes.")
@click.option(
    "--twins", type=click.Path(exists=True, file_okay=False, path_type=Path), help="Folder for the unit files."
)
@click.option("--out", required=True, type=click.Path(dir_okay=False, path_type=Path))
def measure(*, first_seed: int, hands: int, motion: str, plain: bool, jobs: int, twins: Path | None, out: Path) -> None:
    """Record and calibrate random hands, a line of OUT each."""
    done = {line["hand"] for line in _lines(out)}
    for seed in range(first_seed, first_seed + hands):
        if (hand := f"plausible:{seed}") in done:
            continue
        line = calibrated(hand, motion, seed, plain=plain, jobs=jobs, twins=twins)
        with out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
        click.echo(f"{hand}: {line['fitted_rms']} counts, {line['processor_s']} s")


@main.command()
@FILES
def factors(*, measured: Path) -> None:
    """Compute the shipped factors from MEASURED."""
    lines = [line for line in _lines(measured) if line["plain"]]
    kinds = pooled(lines)
    least = conformal_factor([one for off in kinds.values() for one in off])
    text = [
        "# How much wider than their standard deviations intervals are, by kind of number (uncertainty.py).",
        f"# Made by `python -m figures.intervals factors` from {', '.join(line['hand'] for line in lines)},",
        f"# `record --excite {lines[0]['motion']}` at scale {FITTED_SCALE}, commit {lines[0]['commit']}.",
        f"# A kind of fewer than {ENOUGH} numbers has at least the factor of all kinds together.",
        "",
        "[factors]",
        f"hand = {least:.2f}",
    ]
    for name, off in {"servos": [], **kinds}.items():
        own = conformal_factor(off) if off else 1.0
        factor = own if len(off) >= ENOUGH else max(own, least)
        text.append(f"{name if name == 'servos' else json.dumps(name)} = {factor:.2f}  # {len(off)} numbers")
    write_whole(ROOT / "hil" / "data" / FILE, "\n".join(text) + "\n")


@main.command()
@FILES
def keep(*, measured: Path) -> None:
    """Store MEASURED, made with the shipped factors, as the results of docs/calibration.md."""
    lines = [line for line in _lines(measured) if not line["plain"]]
    command = f"`python -m figures.intervals measure --motion {lines[0]['motion']} --out FILE`"
    hands, commits = (", ".join(sorted({line[key] for line in lines})) for key in ("hand", "commit"))
    for name, rows in (("intervals", coverage(lines)), ("twins", twins(lines))):
        store(f"calibration.{name}", rows, command=command, origin=f"{hands}; commit {commits}")


if __name__ == "__main__":
    main()
