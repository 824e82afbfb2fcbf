"""Calibration as a whole: traces in, a fitted unit and what it is worth out."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass

import numpy as np

from hil.system_identification.p_damping import PDampingModel
from hil.system_identification.search import (
    Floats,
    Found,
    Free,
    Model,
    Report,
    Residuals,
    leave_one_out,
    pooled_rms,
    search,
)
from hil.system_identification.trace import Trace
from hil.system_identification.trace_replay import Prediction, replay
from hil.system_identification.unit_parameters import FREE, UnitModel
from hil.targets.target import DEFAULT_FIRMWARE
from model.units import Unit

FEWEST = 3
"""Traces without which leaving one out says nothing."""


@dataclass(frozen=True)
class Calibration:
    """A unit fitted to traces, and how well it predicts."""

    unit: Unit
    traces: tuple[Trace, ...]
    fitted: tuple[str, ...]
    """Names of the fields of the unit that were fitted."""
    found: Found
    held_out: list[Residuals]
    """Each trace predicted by a fit to all others, at each phase of the telemetry grid, predicted less recorded,
    counts: lists by phase, then by trace. Empty for fewer than `FEWEST` traces."""
    yardstick: list[Residuals]
    """The same of the P-and-damping model; empty unless asked for."""
    predictions: tuple[Prediction, ...]
    """Each trace as the fitted unit predicts it."""

    def channel_rms(self) -> Floats:
        """Return the fit's error by trace and channel, (traces, 7) counts rms, readings on their best phase."""
        return np.array([np.sqrt(np.mean(r**2, axis=0)) for r in self.found.residuals])


def calibrate(
    traces: Sequence[Trace],
    start: Unit,
    *,
    firmware: str | None = None,
    free: tuple[Free, ...] = FREE,
    iterations: int = 8,
    jobs: int = 1,
    yardstick: bool = False,
    report: Report = lambda _line: None,
) -> Calibration:
    """Fit a unit to traces of one right hand and cross-validate it.

    Args:
        traces: runs of that hand; several, of different kinds, small and large.
        start: unit that the search starts from and stays near where the traces say nothing.
        firmware: what the hand ran; what the recordings say when None, and 0.2.0 where none says anything.
        free: what is looked for.
        iterations: at most so many steps of the search.
        jobs: processes to spread the replays over.
        yardstick: whether the P-and-damping model is searched and scored the same way, minutes more.
        report: called with lines of progress.

    Raises:
        ValueError: no traces, traces of a left hand, or of several firmwares.
    """
    if not traces:
        raise ValueError("calibration needs at least one recording")
    kept = tuple(traces)
    firmware = _one_firmware(kept, firmware)
    with ProcessPoolExecutor(jobs) if jobs > 1 else nullcontext() as pool:
        model = UnitModel(start, kept, firmware, pool, free)
        found = search(model, iterations=iterations, report=report)
        held_out = _held_out(model, found, report)
    compared: list[Residuals] = []
    if yardstick:
        plain = PDampingModel(kept)
        report("P-and-damping model, for comparison")
        compared = _held_out(plain, search(plain, report=report), report)
    unit = model.unit(found.x)
    predictions = tuple(
        replay(trace, unit, firmware=firmware, phase_s=phase) for trace, phase in zip(kept, found.phases_s, strict=True)
    )
    names = dict.fromkeys(number.name.split(".")[1] for number in model.free)
    fitted = (*names, "spring_closed")
    return Calibration(unit, kept, fitted, found, held_out, compared, predictions)


def _one_firmware(traces: Sequence[Trace], asked: str | None) -> str:
    if left := [trace.name for trace in traces if trace.side != "right"]:
        raise ValueError(f"a unit is fitted to a right hand; {', '.join(left)} is of a left one")
    said = {version for version in (asked, *(trace.firmware for trace in traces)) if version is not None}
    if len(said) > 1:
        raise ValueError(f"recordings and option name several firmwares, {', '.join(sorted(said))}; fit one at a time")
    return said.pop() if said else DEFAULT_FIRMWARE


def held_out_rms(held_out: Sequence[Residuals]) -> float:
    """Return the error on traces not seen, counts rms pooled over readings, channels and phases."""
    return pooled_rms(residual for by_trace in held_out for residual in by_trace)


def _held_out(model: Model, found: Found, report: Report) -> list[Residuals]:
    if len(model.traces) < FEWEST:
        return []
    report("leave one out")
    return leave_one_out(model, found)
