"""Fit of a unit's free numbers to traces.

Gauss-Newton in a trust region, alternating with a search for each recording's phase on the grid of the board's
telemetry. Slopes need most of the replays, so several steps share them. A Gaussian prior around the start keeps numbers
that the traces do not determine near their initial values.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.special import huber

from aero.floats import Floats
from train.identification.unit_parameters import Free, Residuals, UnitModel

Report = Callable[[str], None]

NOISE_COUNTS = 5.0
"""Upper bound of the assumed noise of a reading, counts rms: that of a good prediction of a physical hand."""
QUIETEST_COUNTS = 1.0
"""Lower bound of the assumed noise of a reading, counts rms."""
ROUNDED_COUNTS = 1.0
"""Change of a reading that may be due to rounding, counts."""
NEAR = 4
"""Divisor of the phase grid's step: bound of the phase error of a coarser fit."""
EVALUATIONS = 5
"""Limit of predictions with equal slopes; the first one is already known."""
WORTH_A_STEP = 0.05
"""Threshold of a step's relative gain; below it no further step is taken with equal slopes."""
CONVERGED = 0.02
"""Threshold of an iteration's relative gain; below it the search ends."""
OUTLIER_COUNTS = 40.0
"""Threshold of a residual, counts; above it the loss is linear (collisions, late reads)."""


@dataclass(frozen=True)
class Found:
    """Result of a search."""

    x: Floats
    """Free numbers, (p,)."""
    phases_s: tuple[float, ...]
    """Phase of each recording on the telemetry grid, s."""
    residuals: Residuals
    slopes: list[Floats]
    """Derivative of the residuals, (m, 7, p) per trace, at the start of the last iteration; empty after an early
    interruption."""
    gain: float = 0.0
    """Relative gain of the last iteration."""
    interrupted: BaseException | None = None
    """Exception that interrupted the search, or None; the numbers are the best until then."""


def search(
    model: UnitModel,
    *,
    begin: Found | None = None,
    iterations: int = 3,
    worth: float = CONVERGED,
    report: Report = lambda _line: None,
) -> Found:
    """Return the free numbers and phases of the best prediction, with the last slopes.

    After the first prediction, KeyboardInterrupt and SystemExit end the search with the best numbers so far.

    Args:
        model: unit and traces.
        begin: result of a coarser search; None to start at zero with all phases of the grid.
        iterations: limit of Jacobians.
        worth: threshold of an iteration's relative gain; below it the search ends.
        report: called with lines of progress.
    """
    n, grid, far = len(model.traces), model.phases_s, begin is None
    near_s = float(np.ptp(grid)) / max(len(grid) - 1, 1) / (1 if begin is None else NEAR)
    found = begin or _best_phased(model, np.zeros(len(model.free)), [[phase] * n for phase in grid])
    try:
        if begin is not None:
            found = _best_phased(model, begin.x, [begin.phases_s])
        for iteration in range(iterations):
            report(f"iteration {iteration}: {pooled_rms(found.residuals):.2f} counts")
            noise, settled = noise_counts(found.residuals), found.phases_s
            before = _objective(model, found, noise)
            found = replace(found, slopes=find_slopes(model, found.x, found.phases_s, found.residuals))
            found = _descended(model, found, noise)
            if far:
                # With inaccurate numbers, another phase of the grid may be the best.
                found = _rephased(model, found, [[phase] * n for phase in grid])
                far = found.phases_s != settled
            if not far:
                near_s /= 2.0
                found = _rephased(model, found, [[phase + d for phase in found.phases_s] for d in (-near_s, near_s)])
            found = replace(found, gain=1.0 - _objective(model, found, noise) / before)
            if found.gain < worth and (found.phases_s == settled or begin is not None):
                break
        report(f"found: {pooled_rms(found.residuals):.2f} counts")
        return found
    except (KeyboardInterrupt, SystemExit) as error:
        return replace(found, interrupted=error)


def _descended(model: UnitModel, found: Found, noise: float) -> Found:
    """Return the result after some steps with equal slopes, unchanged if no step lowers the cost."""
    tried = {found.x.tobytes(): found.residuals}

    def residuals(x: Floats) -> Residuals:
        if x.tobytes() not in tried:
            tried[x.tobytes()] = model.residuals([x] * len(model.traces), found.phases_s)
        return tried[x.tobytes()]

    x = solved(residuals, found.slopes, found.x, spreads(model), noise)
    return replace(found, x=x, residuals=tried[x.tobytes()])


def solved(
    residuals: Callable[[Floats], Residuals], slopes: Sequence[Floats], x: Floats, spread: Floats, noise: float
) -> Floats:
    """Return the numbers, (p,), of least cost within `EVALUATIONS` calls of `residuals`, with constant slopes.

    Args:
        residuals: returns the residuals of each trace for given numbers.
        slopes: slopes at `x`, (m, 7, p) per trace.
        x: start; the initial trust region around it has a radius of one spread.
        spread: standard deviation of the prior around zero, (p,).
        noise: assumed noise of a reading, counts.
    """

    def weighed(step: Floats) -> Floats:
        there = x + step * spread
        return np.concatenate([*(r.ravel() / noise for r in residuals(there)), there / spread])

    rows = [slope.reshape(-1, len(x)) * (spread / noise) for slope in slopes]
    jacobian = np.vstack([*rows, np.eye(len(x))])

    def slope(_step: Floats) -> Floats:
        return jacobian

    found = least_squares(
        weighed,
        np.zeros(len(x)),
        jac=slope,
        method="dogbox",  # bounds the step of each number, whereas `trf` bounds their norm
        loss="huber",
        f_scale=OUTLIER_COUNTS / noise,
        ftol=WORTH_A_STEP,
        xtol=None,
        gtol=None,
        max_nfev=EVALUATIONS,
    )
    return x + found.x * spread


def _rephased(model: UnitModel, found: Found, phases_s: Sequence[Sequence[float]]) -> Found:
    """Return the result with a better phase for each trace, among candidates `phases_s` (phases, traces)."""
    best = _best_phased(model, found.x, phases_s)
    nearer = [_cost(there) < _cost(here) for there, here in zip(best.residuals, found.residuals, strict=True)]
    return replace(
        found,
        phases_s=tuple(np.where(nearer, best.phases_s, found.phases_s).tolist()),
        residuals=[
            there if better else here
            for there, here, better in zip(best.residuals, found.residuals, nearer, strict=True)
        ],
    )


def find_slopes(model: UnitModel, x: Floats, phases_s: Sequence[float], residuals: Residuals) -> list[Floats]:
    """Return the slopes of the residuals at `x` by one-sided differences, one prediction per slope group."""
    free, groups = model.free, slope_groups(model.free)
    slopes = [np.zeros((*r.shape, len(free))) for r in residuals]
    tried = np.tile(x, (len(groups), 1))
    for moved, group in zip(tried, groups, strict=True):
        for row in group:
            moved[row] += free[row].step * free[row].spread
    for group, there in zip(groups, rounds(model, tried, [phases_s] * len(groups)), strict=True):
        for row in group:
            channels = list(free[row].channels)
            for slope, after, before in zip(slopes, there, residuals, strict=True):
                slope[:, channels, row] = (after - before)[:, channels] / (free[row].step * free[row].spread)
    return slopes


def without_rounding(slopes: Sequence[Floats], free: Sequence[Free]) -> list[Floats]:
    """Return the slopes with those from a change by one count set to zero, for the intervals.

    For a number without effect, rounding makes thousands of such changes, which would look like information. The search
    itself keeps them, because they are right on average for a number with a small effect.
    """
    moved = np.array([number.step * number.spread for number in free])
    return [np.where(np.isclose(np.abs(slope * moved), ROUNDED_COUNTS), 0.0, slope) for slope in slopes]


def rounds(model: UnitModel, x: Iterable[Floats], phases_s: Iterable[Sequence[float]]) -> list[Residuals]:
    """Return the residuals of several predictions of all traces, computed in one batch.

    Args:
        model: unit and traces.
        x: free numbers (p,) of each prediction.
        phases_s: phases of all traces in each prediction.
    """
    n = len(model.traces)
    missed = model.residuals([one for one in x for _ in range(n)], [phase for one in phases_s for phase in one])
    return [missed[i : i + n] for i in range(0, len(missed), n)]


def slope_groups(free: Sequence[Free]) -> tuple[tuple[int, ...], ...]:
    """Return sets of free numbers without common channels, so that one prediction gives the slopes of a set."""
    groups: list[list[int]] = []
    for row, number in enumerate(free):
        for group in groups:
            felt = {channel for other in group for channel in free[other].channels}
            if not felt & set(number.channels):
                group.append(row)
                break
        else:
            groups.append([row])
    return tuple(map(tuple, groups))


def spreads(model: UnitModel) -> Floats:
    """Return the spreads of a model's free numbers, (p,)."""
    return np.array([number.spread for number in model.free])


def pooled_rms(residuals: Iterable[Floats]) -> float:
    """Return the rms over all readings and channels, counts."""
    return float(np.sqrt(np.mean(np.concatenate(list(residuals)) ** 2)))


def noise_counts(residuals: Residuals) -> float:
    """Return the assumed noise of a reading, counts rms: that of these residuals, within bounds."""
    return float(np.clip(pooled_rms(residuals), QUIETEST_COUNTS, NOISE_COUNTS))


def _best_phased(model: UnitModel, x: Floats, phases_s: Sequence[Sequence[float]]) -> Found:
    """Return the result for `x` with the best phase of each trace, among candidates `phases_s` (phases, traces)."""
    missed = rounds(model, [x] * len(phases_s), phases_s)
    best = np.argmin([[_cost(r) for r in one] for one in missed], axis=0).tolist()
    phases = tuple(phases_s[row][trace] for trace, row in enumerate(best))
    return Found(x, phases, [missed[row][trace] for trace, row in enumerate(best)], [])


def _cost(residual: Floats) -> float:
    """Return Huber's loss: quadratic up to `OUTLIER_COUNTS`, then linear."""
    return 2.0 * float(np.sum(huber(OUTLIER_COUNTS, residual)))


def _objective(model: UnitModel, found: Found, noise: float) -> float:
    return sum(map(_cost, found.residuals)) / noise**2 + float(np.sum((found.x / spreads(model)) ** 2))
