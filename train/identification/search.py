"""Search for the numbers that predict traces best.

Gauss-Newton in a trust region, alternating with what belongs to a recording and not to the hand: where its
readings lie on the grid of the board's telemetry. Slopes are what costs, so several steps are taken with the same ones.
What is searched for is held near the start by a stated spread, so that a number which the traces do not tell stays
where it was.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.special import huber

from aero.floats import Floats
from train.identification.unit_parameters import (
    Free,
    Residuals,
    UnitModel,
)

Report = Callable[[str], None]

NOISE_COUNTS = 5.0
"""How far a good prediction of a physical hand misses a reading, counts rms; readings weigh at least so much against
`Free.spread`."""
QUIETEST_COUNTS = 1.0
"""How far at least: a prediction that misses by less is not believed more, counts rms."""
ROUNDED_COUNTS = 1.0
"""Change of a reading in whole counts that no number need have made."""
NEAR = 4
"""Share of the grid of phases by which those of a coarser model are off at most."""
EVALUATIONS = 5
"""Predictions at most by the same slopes; the first one is known already."""
WORTH_A_STEP = 0.05
"""Relative gain of a step that is worth another with the same slopes."""
CONVERGED = 0.02
"""Relative gain of an iteration that is not worth another."""
OUTLIER_COUNTS = 40.0
"""Residuals count linearly from here on (collisions, late reads), counts."""


@dataclass(frozen=True)
class Found:
    """What a search found."""

    x: Floats
    """(p,) the free numbers."""
    phases_s: tuple[float, ...]
    """Where each recording lies on the telemetry grid."""
    residuals: Residuals
    """With these numbers and phases."""
    slopes: list[Floats]
    """Per trace (m, 7, p), change of the residuals with the free numbers, where the last iteration began; empty when it
    was interrupted before."""
    gain: float = 0.0
    """Relative gain of the last iteration."""
    interrupted: BaseException | None = None
    """Ctrl-C or a termination that came; the numbers are the best until then."""


def search(
    model: UnitModel,
    *,
    begin: Found | None = None,
    iterations: int = 3,
    worth: float = CONVERGED,
    report: Report = lambda _line: None,
) -> Found:
    """Return the free numbers that predict the traces of a model best, and the slopes on the way there.

    Ctrl-C and a termination (`SystemExit`) end the search with the best numbers so far, once there are any.

    Args:
        model: what predicts.
        begin: numbers and phases that a coarser model of the same traces found; the start and any phase when None.
        iterations: at most so many Jacobians.
        worth: relative gain of an iteration that is worth another.
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
                # Far from the numbers the best phase may be another one.
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
    """Return what is found some steps further with the same slopes, or the same when no step lowers the cost."""
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
    """Return the numbers, (p,), of least cost within `EVALUATIONS` of `residuals`, by the same slopes throughout.

    Args:
        residuals: per trace, of numbers.
        slopes: per trace (m, 7, p), at `x`.
        x: where the search starts; a trust region of one spread around it grows or shrinks.
        spread: of the free numbers, (p,); `x` is held near zero by it.
        noise: what residuals are held against, counts.
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
        method="dogbox",  # bounds each number's step, as a box; `trf` bounds the norm of all of them
        loss="huber",
        f_scale=OUTLIER_COUNTS / noise,
        ftol=WORTH_A_STEP,
        xtol=None,
        gtol=None,
        max_nfev=EVALUATIONS,
    )
    return x + found.x * spread


def _rephased(model: UnitModel, found: Found, phases_s: Sequence[Sequence[float]]) -> Found:
    """Return the same numbers with each trace on that one of some phases, (phases, traces), that suits it better."""
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
    """Return the slopes of the residuals at `x` by one-sided differences, one prediction for each slope group."""
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
    """Return slopes less those of readings that changed by one whole count, for the intervals.

    Rounding makes thousands of these for a number that moves no reading, and they would pass for what readings tell of
    it. The search keeps them: where a number moves readings a little, they are right on average.
    """
    moved = np.array([number.step * number.spread for number in free])
    return [np.where(np.isclose(np.abs(slope * moved), ROUNDED_COUNTS), 0.0, slope) for slope in slopes]


def rounds(model: UnitModel, x: Iterable[Floats], phases_s: Iterable[Sequence[float]]) -> list[Residuals]:
    """Return the residuals of several predictions of all traces, made at once.

    Args:
        model: what predicts.
        x: free numbers (p,) of each prediction, the same for all traces.
        phases_s: phases of the traces in each prediction.
    """
    n = len(model.traces)
    missed = model.residuals([one for one in x for _ in range(n)], [phase for one in phases_s for phase in one])
    return [missed[i : i + n] for i in range(0, len(missed), n)]


def slope_groups(free: Sequence[Free]) -> tuple[tuple[int, ...], ...]:
    """Return sets of rows that no channel feels two of: one prediction gives the slopes of a whole set."""
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
    """Return how far a prediction is believed to miss a reading, counts rms: as far as this one does, within bounds."""
    return float(np.clip(pooled_rms(residuals), QUIETEST_COUNTS, NOISE_COUNTS))


def _best_phased(model: UnitModel, x: Floats, phases_s: Sequence[Sequence[float]]) -> Found:
    """Return some numbers with each trace on that one of its phases, (phases, traces), that suits it best."""
    missed = rounds(model, [x] * len(phases_s), phases_s)
    best = np.argmin([[_cost(r) for r in one] for one in missed], axis=0).tolist()
    phases = tuple(phases_s[row][trace] for trace, row in enumerate(best))
    return Found(x, phases, [missed[row][trace] for trace, row in enumerate(best)], [])


def _cost(residual: Floats) -> float:
    """Huber's loss: squares up to `OUTLIER_COUNTS`, then straight on."""
    return 2.0 * float(np.sum(huber(OUTLIER_COUNTS, residual)))


def _objective(model: UnitModel, found: Found, noise: float) -> float:
    return sum(map(_cost, found.residuals)) / noise**2 + float(np.sum((found.x / spreads(model)) ** 2))
