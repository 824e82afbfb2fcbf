"""Do the intervals of a calibration hold? Measured on emulated hands whose numbers are known.

`python -m figures.intervals measure --out FILE` records and calibrates one hand after another as an owner would, and
adds a line a hand to FILE; hands that are there are left out. `factors FILE` writes `hil/data/interval_factors.toml`
from such lines that were made with `--plain`, `keep FILE` the stored result of docs/calibration.md from others.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import click
import numpy as np

from aero.whole_file import write_whole
from figures.cells import Cell
from figures.pages import ROOT
from figures.sources import Row
from figures.stored import Result, folder
from hil.lab.system_identification.calibration import calibrate
from hil.lab.system_identification.excitation import EXPERIMENT, MOTIONS, excitation, play
from hil.lab.system_identification.interval_factors import FILE, conformal_factor, deviations
from hil.lab.system_identification.search import pooled_rms
from hil.lab.system_identification.trace import Trace
from hil.lab.system_identification.trace_replay import replay
from hil.lab.system_identification.uncertainty import COVERAGE_SIGMA
from hil.lab.system_identification.unit_parameters import numbers
from hil.recordings.provenance import source_commit
from hil.recordings.recorder import Recorder
from hil.targets.opening import open_target
from model.units import Unit
from model.units.naming import unit_named

PLAIN = {"servos": 1.0, "hand": 1.0}
"""Factors that leave intervals as they are."""
FITTED_SCALE, LEFT_OUT_SCALE = 0.8, 0.6
"""Scales of the recording that a hand is fitted to, and of the ramps that it is not fitted to."""
PHASES_S = np.arange(0.0, 0.010, 0.001)
"""Telemetry phases on which what was left out is replayed."""
ENOUGH = 19
"""Numbers of a kind from which on the 95 % factor of that kind is known by itself: the largest of 19 holds 19 of 20."""


def recorded(hand: str, motion: str, scale: float, seed: int) -> Trace:
    """Record one motion of one emulated hand."""
    with open_target("emulated", unit=hand, seed=seed) as target:
        recorder = Recorder(target, EXPERIMENT)
        play(target, recorder, excitation(motion, scale=scale))
        return Trace.from_recording(recorder.finish(), motion)


def calibrated(hand: str, motion: str, seed: int, *, plain: bool, jobs: int = 1) -> dict[str, Any]:
    """Record and calibrate one hand, and return how far off its numbers are by kind."""
    began = time.process_time()
    trace = recorded(hand, motion, FITTED_SCALE, seed)
    result = calibrate([trace], unit_named("reference"), leave_out=False, factors=PLAIN if plain else None, jobs=jobs)
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


def coverage(result: Result) -> list[Row]:
    """Numbers in their 95 % intervals by kind, and of all."""
    kinds = pooled(result.rows)
    kinds["all"] = [one for off in kinds.values() for one in off]
    inside = {name: sum(one <= COVERAGE_SIGMA for one in off) for name, off in kinds.items()}
    return [
        ("number", "in their intervals", "of"),
        *((f"`{name}`", Cell.of("{:.0f}", inside[name]), Cell.of("{:.0f}", len(off))) for name, off in kinds.items()),
    ]


def twins(result: Result) -> list[Row]:
    """Error of each twin on the recording that it was fitted to and on one that it was not."""
    return [
        ("hand", "fitted, counts rms", "not fitted, counts rms"),
        *(
            (f"`{row['hand']}`", Cell.of("{:.2f}", row["fitted_rms"]), Cell.of("{:.2f}", row["left_out_rms"]))
            for row in result.rows
        ),
    ]


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
@click.option("--out", required=True, type=click.Path(dir_okay=False, path_type=Path))
def measure(*, first_seed: int, hands: int, motion: str, plain: bool, jobs: int, out: Path) -> None:
    """Record and calibrate random hands, a line of OUT each."""
    done = {line["hand"] for line in _lines(out)}
    for seed in range(first_seed, first_seed + hands):
        if (hand := f"plausible:{seed}") in done:
            continue
        line = calibrated(hand, motion, seed, plain=plain, jobs=jobs)
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
        "# How much wider than their standard deviations intervals are, by kind of number (interval_factors.py).",
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
    """Keep MEASURED, made with the shipped factors, as the result of docs/calibration.md."""
    rows = [line for line in _lines(measured) if not line["plain"]]
    provenance = {
        "command": f"python -m figures.intervals measure --motion {rows[0]['motion']} --out FILE",
        "seeds": ", ".join(row["hand"].split(":")[1] for row in rows),
        "commit": ", ".join(sorted({row["commit"] for row in rows})),
        "generator": "`plausible:SEED`, hands drawn by `model/units/plausible.py`",
    }
    write_whole(folder() / "intervals.json", json.dumps({"provenance": provenance, "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
