"""Calibration as a whole: traces in, a fitted unit and what it is worth out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
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
    without_rounding,
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

COARSE_S = 2.0
"""Motions of each set of channels that the search begins with, s: steps there and back in a recording of ours."""


ARRIVED, MOST_JACOBIANS = 0.2, 3
"""Relative gain of an iteration on whole recordings below which a fit has arrived, and the most of them."""


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

    @property
    def arrived(self) -> bool:
        """Whether more iterations would hardly have changed it."""
        return self.found.interrupted is None and self.found.gain < ARRIVED

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
    report: Report = lambda _line: None,
    progress: Callable[[float, float], None] = lambda _done_s, _about_s: None,
) -> Calibration:
    """Fit a unit to traces of one hand and test it on what was left out.

    Ctrl-C and a termination (`SystemExit`) return the best unit so far; `found.interrupted` is what came.

    Args:
        traces: runs of that hand; several, of different kinds, small and large.
        start: unit that the search starts from and stays near where the traces say nothing.
        firmware: what the hand ran; what the recordings say when None, and 0.2.0 where none says anything.
        free: what is looked for, as far as the traces tell it.
        jobs: processes to spread the replays over.
        report: called with lines of progress.
        progress: called after each replay with the seconds of recordings that were replayed, and about all of them.

    Raises:
        UnusableFileError: no traces, traces of a left hand, of several firmwares, or in which no channel moves.
    """
    if not traces:
        raise UnusableFileError("calibration needs at least one recording")
    kept = tuple(traces)
    firmware = _one_firmware(kept, firmware)
    moved = excited(kept)
    if not moved:
        raise UnusableFileError("no channel moves in these; `aero-hil record --excite all` moves each of them")
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
        # A Jacobian of whole recordings costs ten times as much, so that only the last one is of these.
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
                report(f"the fit has not arrived: its last iteration still gained {found.gain:.0%}")
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
        errors = widened(errors, factors_of(model.free, interval_factors()), spreads(model))
        known = intervals(model.numbers, found.x, errors)
        believed = intervals(model.numbers, found.x, np.diag(spreads(model) ** 2))
        from_readings = told(known, believed)
    return Calibration(model.unit(found.x), kept, firmware, known, from_readings, found, left_out)


def _rounds(model: UnitModel, jacobians: int) -> int:
    """Return about how often a search of so many Jacobians replays all traces; the kept numbers' too for the last."""
    slopes, phases = len(slope_groups(model.free)), len(model.phases_s)
    return phases + jacobians * (slopes + STEPS + 2) + (len(slope_groups(KEPT)) + 1 if jacobians == 1 else 0)


def _one_firmware(traces: Sequence[Trace], asked: str | None) -> str:
    if len({trace.side for trace in traces}) > 1:
        raise UnusableFileError("the recordings are of a left and of a right hand; a unit is one hand")
    said = {version for version in (asked, *(trace.firmware for trace in traces)) if version is not None}
    if len(said) > 1:
        several = ", ".join(sorted(said))
        raise UnusableFileError(f"recordings and option name several firmwares, {several}; fit one at a time")
    return said.pop() if said else DEFAULT_FIRMWARE
