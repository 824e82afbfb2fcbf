"""Cross-validated prediction errors of a fit, from its slopes."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from aero.floats import Floats
from train.identification.search import NOISE_COUNTS, Found, pooled_rms, solved, spreads
from train.identification.unit_parameters import Residuals, UnitModel

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
