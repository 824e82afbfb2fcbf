"""Calibration as a whole: traces in, a fitted unit and what it is worth out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aero.firmware import DEFAULT_FIRMWARE
from hil.recordings.errors import UnusableFileError
from model.units import Unit
from train.identification.replay_score import held_out
from train.identification.search import (
    STEPS,
    Found,
    Report,
    find_slopes,
    noise_counts,
    search,
    slope_groups,
    spreads,
)
from train.identification.trace import Trace
from train.identification.trace_replay import ReplayedTrace, replay
from train.identification.uncertainty import (
    Intervals,
    covariance,
    factors_of,
    interval_factors,
    intervals,
    told,
    widened,
)
from train.identification.unit_parameters import (
    FREE,
    KEPT,
    Floats,
    Free,
    Residuals,
    UnitModel,
    excited,
    felt_otherwise,
    identifiable_parameters,
)
from train.workers import worker_processes

COARSE_S = 6.0
"""Motions of each set of channels that the search begins with, s: steps and a staircase of a recording of ours."""
COARSE_ITERATIONS, FINE_ITERATIONS = 1, 1
"""Jacobians of the first motions, and of whole recordings."""


@dataclass(frozen=True)
class Calibration:
    """A unit fitted to traces, and how well it predicts."""

    unit: Unit
    traces: tuple[Trace, ...]
    firmware: str
    """What the hand ran."""
    intervals: Intervals
    """95 % intervals of the fields of the unit that were fitted."""
    told: Mapping[str, NDArray[np.bool_]]
    """Which entries of these the readings tell; the others have the width that is believed anyway."""
    found: Found
    held_out: list[Residuals]
    """Predicted less recorded, counts, of what was left out of a fit: lists by phase or part, then by trace. Empty
    when it was interrupted before."""

    def channel_rms(self) -> Floats:
        """Return the fit's error by trace and channel, (traces, 7) counts rms, readings on their best phase."""
        return np.array([np.sqrt(np.mean(r**2, axis=0)) for r in self.found.residuals])

    def predictions(self) -> tuple[ReplayedTrace, ...]:
        """Return each trace as the fitted unit predicts it."""
        return tuple(
            replay(trace, self.unit, firmware=self.firmware, side=trace.side, phase_s=phase)
            for trace, phase in zip(self.traces, self.found.phases_s, strict=True)
        )


def calibrate(
    traces: Sequence[Trace],
    start: Unit,
    *,
    firmware: str | None = None,
    free: tuple[Free, ...] = FREE,
    jobs: int = 1,
    factors: Mapping[str, float] | None = None,
    report: Report = lambda _line: None,
    progress: Callable[[int, int], None] = lambda _done, _about: None,
) -> Calibration:
    """Fit a unit to traces of one hand and test it on what was left out.

    Ctrl-C and a termination (`SystemExit`) return the best unit so far; `found.interrupted` is what came.

    Args:
        traces: runs of that hand; several, of different kinds, small and large.
        start: unit that the search starts from and stays near where the traces say nothing.
        firmware: what the hand ran; what the recordings say when None, and 0.2.0 where none says anything.
        free: what is looked for, as far as the traces tell it.
        jobs: processes to spread the replays over.
        factors: how much wider than their standard deviations intervals are, by kind of number; as shipped when None.
        report: called with lines of progress.
        progress: called after each replay with how many are done and about how many it takes.

    Raises:
        UnusableFileError: no traces, traces of a left hand, of several firmwares, or in which no channel moves.
    """
    if not traces:
        raise UnusableFileError("calibration needs at least one recording")
    kept = tuple(traces)
    firmware = _one_firmware(kept, firmware)
    factors = interval_factors() if factors is None else factors
    moved = excited(kept)
    if not moved:
        raise UnusableFileError("no channel moves in these; `aero-hil record --excite all` moves each of them")
    told_by = identifiable_parameters(free, moved, felt_otherwise(kept))
    done = 0

    def replayed() -> None:
        nonlocal done
        done += 1
        progress(done, max(about, done))

    left_out: list[Residuals] = []
    hidden: list[Floats] = []
    with _processes(jobs) as pool:
        model = UnitModel(start, kept, firmware, pool, told_by, replayed=replayed)
        about = _replays(model)
        report(f"the first motions of each channel, {COARSE_S:.0f} s")
        found = search(_coarse(model), iterations=COARSE_ITERATIONS, report=report)
        if found.interrupted is None:
            report("whole recordings")
            found = search(model, begin=found, iterations=FINE_ITERATIONS, report=report)
        fitted = replace(model, start=model.unit(found.x), free=KEPT)
        try:
            if found.interrupted is None:
                report("how well each number is known")
                hidden = find_slopes(fitted, np.zeros(len(KEPT)), found.phases_s, found.residuals)
                left_out = held_out(model, found)
        except (KeyboardInterrupt, SystemExit) as error:
            found = replace(found, interrupted=error)
    known: Intervals = {}
    from_readings: dict[str, NDArray[np.bool_]] = {}
    if found.slopes:
        kept_slopes = hidden or [np.zeros((*r.shape, len(KEPT))) for r in found.residuals]
        noise = noise_counts(found.residuals)
        errors = covariance(found.residuals, found.slopes, spreads(model), kept_slopes, spreads(fitted), noise=noise)
        errors = widened(errors, factors_of(model.free, factors), spreads(model))
        known = intervals(model.numbers, found.x, errors)
        believed = intervals(model.numbers, found.x, np.diag(spreads(model) ** 2))
        from_readings = told(known, believed)
    return Calibration(model.unit(found.x), kept, firmware, known, from_readings, found, left_out)


def _coarse(model: UnitModel) -> UnitModel:
    """Return a model that predicts the first motions of each trace."""
    return replace(model, traces=tuple(trace.shortened(COARSE_S) for trace in model.traces))


def _processes(jobs: int) -> AbstractContextManager[Executor | None]:
    """Return worker processes, or nothing for one job."""
    return nullcontext() if jobs == 1 else worker_processes(jobs)


def _replays(model: UnitModel) -> int:
    """Return about how many replays a calibration takes."""
    slopes, kept, phases = len(slope_groups(model.free)), len(slope_groups(KEPT)), len(model.phases_s)
    coarse, fine = slopes + STEPS + phases + 2, slopes + STEPS + 2
    return len(model.traces) * (phases + COARSE_ITERATIONS * coarse + FINE_ITERATIONS * fine + kept + 1)


def _one_firmware(traces: Sequence[Trace], asked: str | None) -> str:
    if len({trace.side for trace in traces}) > 1:
        raise UnusableFileError("the recordings are of a left and of a right hand; a unit is one hand")
    said = {version for version in (asked, *(trace.firmware for trace in traces)) if version is not None}
    if len(said) > 1:
        several = ", ".join(sorted(said))
        raise UnusableFileError(f"recordings and option name several firmwares, {several}; fit one at a time")
    return said.pop() if said else DEFAULT_FIRMWARE
