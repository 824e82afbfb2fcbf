"""Search for the numbers that predict traces best.

Damped Gauss-Newton, alternating with what belongs to a recording and not to the hand: where its
readings lie on the grid of the board's telemetry. Slopes are what costs, so several steps are taken with the same ones.
What is searched for is held near the start by a stated spread, so that a number which the traces do not tell stays
where it was.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from train.identification.unit_parameters import Floats, Free, Residuals, UnitModel

Report = Callable[[str], None]

NOISE_COUNTS = 5.0
"""How far a good prediction of a physical hand misses a reading, counts rms; readings weigh at least so much against
`Free.spread`."""
QUIETEST_COUNTS = 1.0
"""How far at least: a prediction that misses by less is not believed more, counts rms."""
ROUNDED_COUNTS = 1.0
"""Change of a reading in whole counts that no number need have made."""
LARGEST_STEP = 1.0
"""Longest step of one number in one iteration in units of `Free.spread`."""
SHORTENED = (1.0, 0.4, 0.15)
"""Shares of a step that are tried until one lowers the cost."""
NEAR = 4
"""Share of the grid of phases by which those of a coarser model are off at most."""
STEPS = 3
"""Steps at most that are taken with the same slopes."""
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
    spread, n = spreads(model), len(model.traces)
    before = _objective(model, found, noise)
    for _ in range(STEPS):
        step = gauss_newton_step(found.residuals, found.slopes, found.x, spread, noise)
        step = np.clip(step, -LARGEST_STEP * spread, LARGEST_STEP * spread)
        for share in SHORTENED:
            x = found.x + share * step
            tried = replace(found, x=x, residuals=model.residuals([x] * n, found.phases_s))
            if (cost := _objective(model, tried, noise)) < before:
                break
        else:
            return found
        found, gain, before = tried, 1.0 - cost / before, cost
        if gain < WORTH_A_STEP:
            break
    return found


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


def gauss_newton_step(
    residuals: Residuals, slopes: Sequence[Floats], x: Floats, spread: Floats, noise: float = NOISE_COUNTS
) -> Floats:
    """Return the step, (p,), that minimises the squares of the residuals over `noise` and of `x` over `spread`."""
    normal: NDArray[np.floating] = np.diag(1.0 / np.square(spread))
    gradient: NDArray[np.floating] = x / np.square(spread)
    for residual, slope in zip(residuals, slopes, strict=True):
        flat = slope.reshape(residual.size, len(x))
        weighted = flat * (_weights(residual).reshape(-1, 1) / noise**2)
        normal = normal + weighted.T @ flat
        gradient = gradient + weighted.T @ residual.ravel()
    step: Floats = -np.linalg.solve(normal, gradient)
    return step


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


def _weights(residual: Floats) -> Floats:
    weights: Floats = np.minimum(1.0, OUTLIER_COUNTS / np.maximum(np.abs(residual), 1e-9))
    return weights


def _cost(residual: Floats) -> float:
    """Huber's loss: squares up to `OUTLIER_COUNTS`, then straight on."""
    size = np.abs(residual)
    return float(np.sum(np.where(size < OUTLIER_COUNTS, size**2, OUTLIER_COUNTS * (2 * size - OUTLIER_COUNTS))))


def _objective(model: UnitModel, found: Found, noise: float) -> float:
    return sum(map(_cost, found.residuals)) / noise**2 + float(np.sum((found.x / spreads(model)) ** 2))
