"""Table of docs/calibration.md, and the factors of intervals in `hil/data/interval_factors.toml`.

Both record drawn hands, whose numbers are known, and fit a unit to the recording.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence

import numpy as np
import tomli_w

from aero.floats import Floats
from aero.whole_file import write_whole
from figures.inputs import ROOT
from figures.results import Rows, Shipped
from hil.emulated.any_hand import open_target
from hil.recordings.recorder import Recorder
from model.units import Unit
from model.units.plausible import unit_named
from train.identification.calibration import calibrate
from train.identification.excitation import EXPERIMENT, excitation, play
from train.identification.trace import Trace
from train.identification.trace_replay import replay
from train.identification.uncertainty import COVERAGE_SIGMA, FILE, Intervals
from train.identification.unit_parameters import PHASES_S, numbers

TWINS = ("plausible:99200", "plausible:99201")
MEASURED, MEASURED_SCALE = "plausible:95000", 0.8
"""Hand of the interval factors."""
TWIN_SCALE, NEW_SCALE = 0.5, 0.7
COVERED = 0.95
"""Share of the numbers of a kind that their intervals hold."""
ENOUGH = 19
"""Fewest numbers of a kind whose 95 % factor is known by itself: the largest of 19 holds 19 of 20."""


def recorded(hand: str, motion: str, scale: float, seed: int) -> Trace:
    """Record one motion of an emulated hand."""
    with open_target("emulated", unit=hand, seed=seed) as target:
        recorder = Recorder(target, EXPERIMENT)
        play(target, recorder, excitation(motion, scale=scale))
        return Trace.from_recording(recorder.finish(), motion)


def best_rms(trace: Trace, unit: Unit) -> str:
    """Return the error of a unit on a recording at its best phase of the telemetry grid, counts rms."""
    misses = [replay(trace, unit, phase_s=phase).counts - trace.counts for phase in PHASES_S]
    return f"{min(float(np.sqrt(np.mean(miss**2))) for miss in misses):.2f}"


def twins() -> Rows:
    """Error of twins on the recording that they are fitted to, and on one with other noise and scale."""
    kinds = ("truth", "twin", "`reference`")
    head = ["hand", *(f"fitted to, {kind}" for kind in kinds), *(f"new, {kind}" for kind in kinds)]
    return [[*head, "worst take-up, mm", "arrived", "core-seconds"], *map(_twin, TWINS)]


def _twin(hand: str) -> list[str]:
    fitted_to, new = recorded(hand, "all", TWIN_SCALE, 1), recorded(hand, "all", NEW_SCALE, 2)
    began = time.process_time()
    found = calibrate([fitted_to], unit_named("reference"))
    core_s = time.process_time() - began
    units = (unit_named(hand), found.unit, unit_named("reference"))
    off_m = np.subtract(*(numbers(one)["hand.cable_take_up"] for one in units[:2]))
    errors = [best_rms(trace, one) for trace in (fitted_to, new) for one in units]
    return [hand, *errors, f"{1e3 * np.abs(off_m).max():.2f}", "yes" if found.arrived else "no", f"{core_s:.0f}"]


def first_recording() -> Rows:
    """Part of `twins` without a fit."""
    trace = recorded(TWINS[0], "all", TWIN_SCALE, 1)
    errors = [best_rms(trace, unit_named(name)) for name in (TWINS[0], "reference")]
    return [["hand", "fitted to, truth", "fitted to, `reference`"], [TWINS[0], *errors]]


def measured_recording() -> Rows:
    """Recording behind the interval factors, and the errors of two units on it."""
    trace = recorded(MEASURED, "steps", MEASURED_SCALE, 95_000)
    errors = [best_rms(trace, unit_named(name)) for name in (MEASURED, "reference")]
    return [["hand", "readings", "truth, counts rms", "`reference`"], [MEASURED, str(len(trace.counts)), *errors]]


def interval_factors() -> str:
    """Return the factors by which intervals are wider than their standard deviations, as TOML."""
    trace = recorded(MEASURED, "steps", MEASURED_SCALE, 95_000)
    found = calibrate([trace], unit_named("reference"), factors={"servos": 1.0, "hand": 1.0})
    off = deviations(numbers(found.unit), numbers(unit_named(MEASURED)), found.intervals)
    least = conformal_factor([value for values in off.values() for value in values])
    factors = {"hand": least, "servos": least}
    for name, values in off.items():
        if not name.startswith("servos"):
            own = conformal_factor(values)
            factors[name] = own if len(values) >= ENOUGH else max(own, least)
    head = "# Factors of intervals over their standard deviations, by kind of number (uncertainty.py).\n"
    head += f"# Made by `python -m figures calibration.interval_factors` from one hand, {MEASURED}.\n"
    return head + tomli_w.dumps({"factors": {name: round(factor, 2) for name, factor in factors.items()}})


def deviations(values: Mapping[str, Floats], truth: Mapping[str, Floats], known: Intervals) -> dict[str, Floats]:
    """Return the error of each fitted number in standard deviations of its 95 % interval, arrays by `section.field`."""
    found = {}
    for name, (low, high) in known.items():
        fitted = (low < high) & (values[name] != 0.0)
        value, above, true = values[name][fitted], high[fitted], truth[name][fitted]
        if not name.endswith("take_up"):
            value, above, true = (np.log(np.abs(one)) for one in (value, above, true))
        found[name] = COVERAGE_SIGMA * np.abs(true - value) / np.abs(above - value)
    return found


def conformal_factor(off: Sequence[float] | Floats) -> float:
    """Return the factor with which intervals hold a further number in 95 of 100 cases, at least 1.

    Split conformal prediction: the k-th smallest of n, k = 0.95 (n + 1) rounded up, or the largest if n is too small.

    Args:
        off: errors of the numbers of one kind, standard deviations.
    """
    k = min(math.ceil(COVERED * (len(off) + 1)), len(off))
    return max(1.0, float(np.sort(off)[k - 1]) / COVERAGE_SIGMA) if k else 1.0


def make() -> None:
    """Measure the interval factors and write them, in some minutes of one core."""
    write_whole(ROOT / "hil" / "data" / FILE, interval_factors())


TABLES = (twins,)
SAMPLES = {twins: first_recording}
SHIPPED = {"interval_factors": Shipped((f"hil/data/{FILE}",), (), measured_recording, make)}
