"""Calibration of a unit: fit to traces, 95 % intervals, cross-validated residuals."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aero.firmware import DEFAULT_FIRMWARE
from aero.floats import Floats
from hil.recordings.errors import UnusableFileError
from model.units import Unit
from train.identification.cross_validation import held_out
from train.identification.search import (
    EVALUATIONS,
    Found,
    Report,
    find_slopes,
    noise_counts,
    search,
    slope_groups,
    spreads,
    without_rounding,
)
from train.identification.trace import Trace
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
    Free,
    Residuals,
    UnitModel,
    excited,
    felt_otherwise,
    identifiable_parameters,
)
from train.workers import worker_processes

COARSE_S = 2.0
"""Duration of the motions per set of channels in the coarse fit, s; a step with its return in `record`'s excitation."""


ARRIVED, MOST_JACOBIANS = 0.2, 3
"""Threshold of an iteration's relative gain on whole recordings, below which the fit has converged; largest number of
these iterations."""


@dataclass(frozen=True)
class Calibration:
    """Unit fitted to traces, with its uncertainty and prediction errors."""

    unit: Unit
    traces: tuple[Trace, ...]
    firmware: str
    intervals: Intervals
    """95 % intervals of the fitted fields."""
    told: Mapping[str, NDArray[np.bool_]]
    """Masks of the entries that the readings determine; the others have the width of the prior."""
    found: Found
    held_out: list[Residuals]
    """Cross-validated residuals, counts, by part, then by trace; empty after an interruption."""

    @property
    def arrived(self) -> bool:
        """Whether the fit has converged."""
        return self.found.interrupted is None and self.found.gain < ARRIVED

    def channel_rms(self) -> Floats:
        """Return the fit's error by trace and channel, (traces, 7) counts rms, each trace at its fitted phase."""
        return np.array([np.sqrt(np.mean(r**2, axis=0)) for r in self.found.residuals])


def calibrate(
    traces: Sequence[Trace],
    start: Unit,
    *,
    firmware: str | None = None,
    free: tuple[Free, ...] = FREE,
    factors: Mapping[str, float] | None = None,
    jobs: int = 1,
    report: Report = lambda _line: None,
    progress: Callable[[float, float], None] = lambda _done_s, _about_s: None,
) -> Calibration:
    """Fit a unit to traces of one hand and cross-validate it.

    KeyboardInterrupt and SystemExit return the best unit so far, with the exception in `found.interrupted`.

    Args:
        traces: runs of the hand, preferably several with small and large motions.
        start: starting unit; numbers that the traces do not determine stay near its values.
        firmware: firmware of the hand; None for the recordings' declaration, or `DEFAULT_FIRMWARE` without one.
        free: free numbers, of which the traces determine a subset.
        factors: factors of the intervals by kind of number; None for the shipped ones.
        jobs: number of processes for the replays.
        report: called with lines of progress.
        progress: called after each replay with the replayed seconds of recordings and an estimate of their total.

    Raises:
        UnusableFileError: no traces, traces without motion, or of both sides or several firmware versions.
    """
    if not traces:
        raise UnusableFileError("calibration needs at least one recording")
    kept = tuple(traces)
    firmware = _one_firmware(kept, firmware)
    moved = excited(kept)
    if not moved:
        raise UnusableFileError("no channel moves; `aero-hil record --excite all` moves each of them")
    told_by = identifiable_parameters(free, moved, felt_otherwise(kept))
    done_s = about_s = 0.0

    def replayed(trace: Trace) -> None:
        nonlocal done_s
        done_s += trace.seconds
        progress(done_s, max(about_s, done_s))

    left_out: list[Residuals] = []
    hidden: list[Floats] = []
    with nullcontext() if jobs == 1 else worker_processes(jobs) as pool:
        model = UnitModel(start, kept, firmware, pool, told_by, replayed=replayed)
        report(f"the first motions of each channel, {COARSE_S:.0f} s")
        # A Jacobian of whole recordings takes ten times as long, so only the last ones use these.
        shortened = tuple(trace.shortened(COARSE_S) for trace in kept)
        coarse_s, whole_s = (sum(trace.seconds for trace in of) for of in (shortened, kept))
        about_s = coarse_s * _rounds(model, 3) + whole_s * _rounds(model, 1)
        found = search(replace(model, traces=shortened), report=report)
        if found.interrupted is None:
            report("whole recordings")
            about_s = done_s + whole_s * _rounds(model, 1)
            found = search(model, begin=found, iterations=MOST_JACOBIANS, worth=ARRIVED, report=report)
            about_s = done_s + whole_s * (len(slope_groups(KEPT)) + 1)
            if found.interrupted is None and found.gain >= ARRIVED:
                report(f"the fit has not converged: its last iteration reduced the residual by {found.gain:.0%}")
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
        slopes = without_rounding(found.slopes, model.free)
        errors = covariance(found.residuals, slopes, spreads(model), kept_slopes, spreads(fitted), noise=noise)
        errors = widened(errors, factors_of(model.free, factors or interval_factors()), spreads(model))
        known = intervals(model.numbers, found.x, errors)
        believed = intervals(model.numbers, found.x, np.diag(spreads(model) ** 2))
        from_readings = told(known, believed)
    return Calibration(model.unit(found.x), kept, firmware, known, from_readings, found, left_out)


def _rounds(model: UnitModel, jacobians: int) -> int:
    """Estimate the replays of all traces for a search with `jacobians`; a single one includes the fixed numbers."""
    slopes, phases = len(slope_groups(model.free)), len(model.phases_s)
    return phases + jacobians * (slopes + EVALUATIONS) + (len(slope_groups(KEPT)) + 1 if jacobians == 1 else 0)


def _one_firmware(traces: Sequence[Trace], asked: str | None) -> str:
    if len({trace.side for trace in traces}) > 1:
        raise UnusableFileError("the recordings are of a left and of a right hand; a unit is one hand")
    said = {version for version in (asked, *(trace.firmware for trace in traces)) if version is not None}
    if len(said) > 1:
        several = ", ".join(sorted(said))
        raise UnusableFileError(f"recordings and option name several firmwares, {several}; fit one at a time")
    return said.pop() if said else DEFAULT_FIRMWARE
