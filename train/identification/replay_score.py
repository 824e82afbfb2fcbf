"""Prediction errors of a unit on recordings, beside the hand's repeatability; positions, currents, warming by channel.

The repeatability, from recordings with equal commands, is a lower bound for the error of any model.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from aero.floats import Floats
from train.identification.search import NOISE_COUNTS, Found, pooled_rms, solved, spreads
from train.identification.trace import CHANNELS, Trace
from train.identification.trace_replay import ReplayedTrace
from train.identification.unit_parameters import Residuals, UnitModel

SAME_READ_S = 0.02
"""Largest difference of the times since the command for which readings of two runs are compared, s."""


@dataclass(frozen=True)
class Errors:
    """Root-mean-square errors by channel, (7,) float; NaN without recorded values."""

    counts: Floats
    """Positions, servo counts."""
    currents_a: Floats
    warming_c: Floats
    """Rise of the temperature from the first to the last reading, degC."""


@dataclass(frozen=True)
class ReplayScore:
    """Prediction errors of a unit and repeatability of the hand."""

    runs: tuple[tuple[str, Errors], ...]
    """Name of each recording with the errors over its replays."""
    all_runs: Errors
    repeats: Errors
    """Differences between recordings with equal commands on a channel; NaN without such a pair."""


def score(traces: Sequence[Trace], predicted: Sequence[Sequence[ReplayedTrace]]) -> ReplayScore:
    """Compare each trace with its replays: one at the fitted phase, or one per phase of the grid if it is unknown."""
    misses = [[_missed(trace, one) for one in of] for trace, of in zip(traces, predicted, strict=True)]
    pairs = [_between(a, b, same) for a, b in combinations(traces, 2) if (same := _same_commands(a, b)).any()]
    return ReplayScore(
        tuple((trace.name, _errors(of)) for trace, of in zip(traces, misses, strict=True)),
        _errors([one for of in misses for one in of]),
        _errors(pairs),
    )


@dataclass(frozen=True)
class _Misses:
    counts: Floats
    currents: Floats
    rise: Floats
    """Error of the temperature rise, (1, 7), degC."""


def _missed(trace: Trace, predicted: ReplayedTrace) -> _Misses:
    recorded = np.isfinite(trace.temperatures)
    warmed = rise(trace.temperatures) - rise(np.where(recorded, predicted.temperatures, np.nan))
    return _Misses(predicted.counts - trace.counts, predicted.currents - trace.currents, warmed[np.newaxis])


def rise(temperatures: Floats) -> Floats:
    """Return the last minus the first finite reading of each column (m, 7); NaN with fewer than two."""
    found = np.full(CHANNELS, np.nan)
    for channel, column in enumerate(temperatures.T):
        read = column[np.isfinite(column)]
        if len(read) > 1:
            found[channel] = read[-1] - read[0]
    return found


def _same_commands(a: Trace, b: Trace) -> NDArray[np.bool_]:
    """Return a mask of the channels with equal commands in both traces, (7,)."""
    if a.codes.shape != b.codes.shape:
        return np.zeros(CHANNELS, bool)
    same: NDArray[np.bool_] = (a.codes == b.codes).all(axis=0)
    return same


def _between(a: Trace, b: Trace, same: NDArray[np.bool_]) -> _Misses:
    """Compare readings with equal delay after equal commands; `same` masks the channels, (7,)."""
    index = np.clip(np.searchsorted(a.t_command, a.t_read, side="right") - 1, 0, None)
    wanted = b.t_command[index] + (a.t_read - a.t_command[index])
    nearest = np.abs(b.t_read[np.newaxis] - wanted[:, np.newaxis]).argmin(axis=1)
    near = np.abs(b.t_read[nearest] - wanted) <= SAME_READ_S
    return _Misses(
        *(
            np.where(same, values, np.nan)
            for values in (
                (b.counts[nearest] - a.counts)[near],
                (b.currents[nearest] - a.currents)[near],
                (rise(b.temperatures) - rise(a.temperatures))[np.newaxis],
            )
        )
    )


def _errors(misses: Sequence[_Misses]) -> Errors:
    return Errors(
        _rms([one.counts for one in misses]), _rms([one.currents for one in misses]), _rms([one.rise for one in misses])
    )


def _rms(parts: Sequence[Floats]) -> Floats:
    values = np.concatenate([np.empty((0, CHANNELS)), *parts])
    counted = np.isfinite(values).sum(axis=0)
    squares = np.nansum(np.square(values), axis=0)
    return np.where(counted > 0, np.sqrt(squares / np.maximum(counted, 1)), np.nan)


FEWEST = 3
"""Smallest number of traces for leaving out whole traces."""
PARTS = 4
"""Number of parts for cross-validation with fewer than `FEWEST` traces."""
BLOCK_S = 2.4
"""Length of the blocks assigned to the parts in turn, s: two steps and back, so that each part has all channels."""


def held_out(model: UnitModel, found: Found) -> list[Residuals]:
    """Return cross-validated residuals: of each part with numbers fitted to the others, by part, then by trace.

    A part is a trace, or every fourth block of each trace with fewer than `FEWEST`. A search from the complete fit by
    its slopes gives the numbers without a part, and the slopes give its prediction, so nothing is replayed (PRESS, as
    in linear regression).
    """
    n = len(model.traces)
    part_of = [
        np.full(len(trace.t_read), k) if n >= FEWEST else _parts(trace.t_read) for k, trace in enumerate(model.traces)
    ]
    return [_predicted(model, found, [of == part for of in part_of]) for part in range(n if n >= FEWEST else PARTS)]


def held_out_rms(held: Sequence[Residuals]) -> float:
    """Return the cross-validated error, counts rms over readings, channels and parts."""
    return pooled_rms(residual for by_trace in held for residual in by_trace)


def _predicted(model: UnitModel, found: Found, left_out: Sequence[NDArray[np.bool_]]) -> Residuals:
    """Return the residuals of the readings `left_out` (mask (m,) per trace) with numbers fitted to the others."""

    def moved(x: Floats) -> Residuals:
        return [r + s @ (x - found.x) for r, s in zip(found.residuals, found.slopes, strict=True)]

    def others(x: Floats) -> Residuals:
        return [r[~out] for r, out in zip(moved(x), left_out, strict=True)]

    slopes = [s[~out] for s, out in zip(found.slopes, left_out, strict=True)]
    x = solved(others, slopes, found.x, spreads(model), NOISE_COUNTS)
    return [r[out] for r, out in zip(moved(x), left_out, strict=True)]


def _parts(times: Floats) -> NDArray[np.int64]:
    """Return the part of each reading, (m,) 0..PARTS-1; a short trace has shorter blocks."""
    length = min(BLOCK_S, (times[-1] - times[0]) / (2 * PARTS))
    parts: NDArray[np.int64] = ((times - times[0]) // max(length, 1e-9)).astype(np.int64) % PARTS
    return parts
