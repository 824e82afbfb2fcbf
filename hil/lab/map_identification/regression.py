"""Ordinary least squares with what it takes to judge a fit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel, Joint
from hil.lab.map_identification.captures import Capture
from model.geometry import Side
from model.routed import TENDONS, build_routed

Floats = NDArray[np.float64]
Design = Callable[[Floats, Floats, Floats], tuple[Floats, ...]]

_ORIGIN = (0.875, 0.0325, 0.0975)
"""Middle of abduction (rad) and of both cables (m); products are taken around it to keep them well conditioned."""

DESIGNS: dict[str, Design] = {
    "first order": lambda a, x, y: (a, x, y),
    "bilinear": lambda a, x, y: (a, x, y, (x - _ORIGIN[1]) * (y - _ORIGIN[2])),
    "quadratic": lambda a, x, y: (
        *(a, x, y, (x - _ORIGIN[1]) * (y - _ORIGIN[2])),
        *((x - _ORIGIN[1]) ** 2, (y - _ORIGIN[2]) ** 2),
    ),
}
"""Regressors from abduction (rad), CMC cable and flexor cable (m); a constant is always added last."""


@dataclass(frozen=True)
class Fit:
    """One least squares fit of several targets."""

    coefficients: Floats
    """(targets, regressors)."""
    standard_errors: Floats
    """Same shape; robust against errors that go together within a sweep."""
    r_squared: Floats
    """(targets,)."""
    residuals: Floats
    """(n, targets), target minus fit."""


def regressors(design: str, capture: Capture) -> Floats:
    """Return the regressors of a capture's thumb, (n, k); abduction is left out where it was held."""
    abduction, cmc, flexor = capture.lengths[:, 4:].T
    columns = (*DESIGNS[design](abduction, cmc, flexor), np.ones_like(cmc))
    held = np.ptp(abduction) < np.deg2rad(10.0)
    return np.column_stack(columns[1:] if held else columns)


def least_squares(x: Floats, targets: Floats, sweep: NDArray[np.int64]) -> Fit:
    """Fit `targets` (n, t) by `x` (n, k).

    What a first-order fit leaves is misfit and no noise: it is the same along a whole sweep, so samples do not count as
    independent. The standard errors are cluster-robust over sweeps (Liang and Zeger), with the usual factor
    for few clusters.

    Raises:
        ValueError: the regressors do not span their space, or a target is constant; something was not moved.
    """
    if np.linalg.matrix_rank(x / np.abs(x).max(axis=0)) < x.shape[1]:
        raise ValueError("the sweeps do not tell the coefficients apart; a channel was not moved on its own")
    spread = ((targets - targets.mean(axis=0)) ** 2).sum(axis=0)
    if not spread.all():
        raise ValueError(f"target {int(np.argmin(spread))} is constant; the sweeps did not move it")
    solution = np.asarray(np.linalg.lstsq(x, targets, rcond=None)[0], np.float64)
    residuals: Floats = targets - x @ solution
    return Fit(
        solution.T,
        _cluster_robust(x, residuals, sweep),
        1.0 - (residuals**2).sum(axis=0) / spread,
        residuals,
    )


def _cluster_robust(x: Floats, residuals: Floats, sweep: NDArray[np.int64]) -> Floats:
    inverse = np.linalg.inv(x.T @ x)
    labels = np.unique(sweep)
    scores = np.stack([x[sweep == label].T @ residuals[sweep == label] for label in labels])
    middle = np.einsum("skt,slt->tkl", scores, scores) * len(labels) / (len(labels) - 1)
    variances: Floats = np.einsum("ij,tjk,ki->ti", inverse, middle, inverse)
    errors: Floats = np.sqrt(variances)
    return errors


def two_pose_radii(side: Side = "right") -> Floats:
    """Return the cable taken up over each joint's full range divided by that range, (7, 16) float, m/rad.

    One joint at a time, the others extended; kinematics only, so that nothing gives and nothing rubs. Abduction's row
    is its joint's own.
    """
    lengths = _Lengths(side)
    extended = lengths.at(np.zeros(len(Joint)))
    radii = np.zeros((len(Channel), len(Joint)))
    for joint in Joint:
        posture = np.zeros(len(Joint))
        posture[joint] = lengths.upper_limits[joint]
        radii[:, joint] = (extended - lengths.at(posture)) / posture[joint]
    radii[Channel.THUMB_ABDUCTION, Joint.THUMB_ABDUCTION] = 1.0
    return radii


def flexor_radius(side: Side = "right") -> float:
    """Return the flexor's radius with MCP and IP turning together as their coupling makes them, m/rad."""
    lengths = _Lengths(side)
    posture = np.zeros(len(Joint))
    angle = lengths.upper_limits[Joint.THUMB_MCP]
    posture[[Joint.THUMB_MCP, Joint.THUMB_IP]] = angle
    taken_up = lengths.at(np.zeros(len(Joint))) - lengths.at(posture)
    return float(taken_up[Channel.THUMB_FLEXOR] / angle)


class _Lengths:
    """Cable lengths of a posture."""

    def __init__(self, side: Side) -> None:
        self._model = build_routed(side).compile()
        self._data = mujoco.MjData(self._model)
        self._tendons = [self._model.tendon(name).id for name in TENDONS.values()]
        self.upper_limits: Floats = self._model.jnt_range[: len(Joint), 1].copy()

    def at(self, posture: Floats) -> Floats:
        self._data.qpos[:] = posture
        mujoco.mj_fwdPosition(self._model, self._data)
        lengths = np.zeros(len(Channel))
        lengths[list(TENDONS)] = self._data.ten_length[self._tendons]
        return lengths
