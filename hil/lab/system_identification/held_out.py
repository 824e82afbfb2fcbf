"""The test on what a search has not seen: whole traces where there are enough of them, else parts of each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hil.lab.system_identification.search import (
    LARGEST_STEP,
    Floats,
    Found,
    Model,
    Residuals,
    gauss_newton_step,
    pooled_rms,
    rounds,
    spreads,
)

FEWEST = 3
"""Traces without which leaving a whole one out says nothing."""
PARTS = 4
"""Parts that fewer traces are cut into."""
BLOCK_S = 2.4
"""The parts take turns by blocks of this length, two steps there and back, s; so that each sees every channel."""


def held_out(model: Model, found: Found) -> list[Residuals]:
    """Predict what was left out with numbers found on the rest: lists by phase, or by part, then by trace.

    The numbers without it are a Gauss-Newton step from those found with all, which is where a search without it would
    end but for the curvature. What was left out is then predicted in full: whole traces at every phase, parts of a
    trace on the phase of the rest.
    """
    n = len(model.traces)
    if n >= FEWEST:
        whole = [[np.full(len(r), i != k) for i, r in enumerate(found.residuals)] for k in range(n)]
        numbers = [_without(model, found, kept) for kept in whole]
        return [model.residuals(numbers, [phase] * n) for phase in model.phases_s]
    part_of = [_parts(trace.t_read) for trace in model.traces]
    rest = [_without(model, found, [of != part for of in part_of]) for part in range(PARTS)]
    predicted = rounds(model, rest, [found.phases_s] * PARTS)
    return [[one[of == part] for one, of in zip(missed, part_of, strict=True)] for part, missed in enumerate(predicted)]


def held_out_rms(held: Sequence[Residuals]) -> float:
    """Return the error on what was left out, counts rms pooled over readings, channels, and phases or parts."""
    return pooled_rms(residual for by_trace in held for residual in by_trace)


def _without(model: Model, found: Found, kept: Sequence[NDArray[np.bool_]]) -> Floats:
    """Return the free numbers that a search on the readings `kept`, (m,) of each trace, would find."""
    spread = spreads(model)
    residuals = [r[keep] for r, keep in zip(found.residuals, kept, strict=True)]
    slopes = [s[keep] for s, keep in zip(found.slopes, kept, strict=True)]
    step = gauss_newton_step(residuals, slopes, found.x, spread)
    moved: Floats = found.x + np.clip(step, -LARGEST_STEP * spread, LARGEST_STEP * spread)
    return moved


def _parts(times: Floats) -> NDArray[np.int64]:
    """Return which part each reading is in, (m,) 0..PARTS-1; blocks are shorter where a trace has too few."""
    length = min(BLOCK_S, (times[-1] - times[0]) / (2 * PARTS))
    parts: NDArray[np.int64] = ((times - times[0]) // max(length, 1e-9)).astype(np.int64) % PARTS
    return parts
