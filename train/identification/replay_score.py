"""What a unit is worth on recordings: positions, currents and warming by channel, beside what a hand repeats of itself.

Recordings of the same commands tell how far the hand itself comes out differently, which no model can get below.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from train.identification.search import (
    LARGEST_STEP,
    Found,
    gauss_newton_step,
    pooled_rms,
    spreads,
)
from train.identification.trace import CHANNELS, Trace
from train.identification.trace_replay import ReplayedTrace
from train.identification.unit_parameters import Floats, Residuals, UnitModel

SAME_READ_S = 0.02
"""Readings of two runs this near in their commands' time are compared, s."""


@dataclass(frozen=True)
class Errors:
    """Root mean squares by channel, (7,) float; NaN where nothing was recorded."""

    counts: Floats
    """Positions, servo counts."""
    currents_a: Floats
    """Currents, A."""
    warming_c: Floats
    """Rise of the temperature from the first to the last reading, degC."""


@dataclass(frozen=True)
class ReplayScore:
    """A unit's errors, and the hand's own differences."""

    runs: tuple[tuple[str, Errors], ...]
    """By recording, over its replays."""
    all_runs: Errors
    """Over all readings of all recordings and replays."""
    repeats: Errors
    """Between recordings in which a channel has the same commands; NaN where there is no such pair."""


def score(traces: Sequence[Trace], predicted: Sequence[Sequence[ReplayedTrace]]) -> ReplayScore:
    """Compare each trace with its replays, one or more each: on the phase of a fit, or on all where none is known."""
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
    """(1, 7)"""


def _missed(trace: Trace, predicted: ReplayedTrace) -> _Misses:
    recorded = np.isfinite(trace.temperatures)
    warmed = rise(trace.temperatures) - rise(np.where(recorded, predicted.temperatures, np.nan))
    return _Misses(predicted.counts - trace.counts, predicted.currents - trace.currents, warmed[np.newaxis])


def rise(temperatures: Floats) -> Floats:
    """Return the last less the first finite reading of each column (m, 7), NaN without two."""
    found = np.full(CHANNELS, np.nan)
    for channel, column in enumerate(temperatures.T):
        read = column[np.isfinite(column)]
        if len(read) > 1:
            found[channel] = read[-1] - read[0]
    return found


def _same_commands(a: Trace, b: Trace) -> NDArray[np.bool_]:
    """Return which channels have the same commands in both, (7,)."""
    if a.codes.shape != b.codes.shape:
        return np.zeros(CHANNELS, bool)
    same: NDArray[np.bool_] = (a.codes == b.codes).all(axis=0)
    return same


def _between(a: Trace, b: Trace, same: NDArray[np.bool_]) -> _Misses:
    """Compare readings that come at the same time after the same command, on the channels that are the `same`, (7,)."""
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
"""Traces without which leaving a whole one out says nothing."""
PARTS = 4
"""Parts that fewer traces are cut into."""
BLOCK_S = 2.4
"""The parts take turns by blocks of this length, two steps there and back, s; so that each sees every channel."""


def held_out(model: UnitModel, found: Found) -> list[Residuals]:
    """Predict what was left out with numbers found on the rest: lists by part, then by trace.

    A part is a trace, or blocks of each where there are few. The numbers without it are a Gauss-Newton step from those
    found with all, and it is predicted by the same slopes; so that nothing is replayed (PRESS, as in linear
    regression).
    """
    n = len(model.traces)
    part_of = [
        np.full(len(trace.t_read), k) if n >= FEWEST else _parts(trace.t_read) for k, trace in enumerate(model.traces)
    ]
    return [_predicted(model, found, [of == part for of in part_of]) for part in range(n if n >= FEWEST else PARTS)]


def held_out_rms(held: Sequence[Residuals]) -> float:
    """Return the error on what was left out, counts rms pooled over readings, channels, and phases or parts."""
    return pooled_rms(residual for by_trace in held for residual in by_trace)


def _predicted(model: UnitModel, found: Found, left_out: Sequence[NDArray[np.bool_]]) -> Residuals:
    """Return the residuals of the readings `left_out`, (m,) of each trace, with numbers found on the others."""
    spread = spreads(model)
    residuals = [r[~out] for r, out in zip(found.residuals, left_out, strict=True)]
    slopes = [s[~out] for s, out in zip(found.slopes, left_out, strict=True)]
    step = gauss_newton_step(residuals, slopes, found.x, spread)
    step = np.clip(step, -LARGEST_STEP * spread, LARGEST_STEP * spread)
    return [r[out] + s[out] @ step for r, s, out in zip(found.residuals, found.slopes, left_out, strict=True)]


def _parts(times: Floats) -> NDArray[np.int64]:
    """Return which part each reading is in, (m,) 0..PARTS-1; blocks are shorter where a trace has too few."""
    length = min(BLOCK_S, (times[-1] - times[0]) / (2 * PARTS))
    parts: NDArray[np.int64] = ((times - times[0]) // max(length, 1e-9)).astype(np.int64) % PARTS
    return parts
