"""Identify the actuation map on the routed hand (paper, section "The actuation map").

The hand is swept as in the paper's run, the coefficients are fitted to what it did, and both sets are compared on
sweeps that neither was fitted to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aero.actuation import stages
from aero.actuation.coefficients import Coefficients, load_coefficients
from aero.channels import FINGERS, THUMB, Channel, Joint
from hil.checks.staircase.reachable_range import calibrated_range
from hil.lab.map_sweeps import (
    SAMPLE_S,
    SAMPLES_A_LEVEL,
    STAIRCASE_LEVELS,
    Capture,
    JointedSimulator,
    joined,
    staircase,
    thumb_grid,
)

Floats = NDArray[np.float64]

FLEXION = (Joint.THUMB_CMC, Joint.THUMB_MCP, Joint.THUMB_IP)
CABLES = (Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR)
GRID_ABDUCTIONS = (0.0, 0.35, 0.7, 1.05, 1.4, 1.7)
"""Abductions at which the grid is repeated to cover the workspace, rad."""


@dataclass(frozen=True)
class Fit:
    """One least squares fit of several targets."""

    coefficients: Floats
    """(targets, regressors)."""
    standard_errors: Floats
    """Same shape; robust against errors that are correlated within a sweep."""
    r_squared: Floats
    """(targets,)."""


@dataclass(frozen=True)
class Residuals:
    """How far coefficients are from what the simulator did; the last axis is CMC, MCP, IP or the two cables."""

    joints_rms_rad: Floats
    """(3,) estimated against true joint angles."""
    joints_max_rad: Floats
    round_trip_rms_m: Floats
    """(2,) forward and inverse map composed, simulator length to travel to simulator length."""
    round_trip_max_m: Floats
    round_trip_max_rad: Floats
    """(3,) the same, seen in the estimated joint angles."""


@dataclass(frozen=True)
class Identification:
    """Coefficients of the map, and how good they are."""

    coefficients: Coefficients
    """As identified, on the mechanism's own winding radii."""
    regression: Fit
    """C, (3, 4)."""
    inverse: tuple[Fit, Fit]
    """Travel of the CMC and the flexor cable by its own length and a constant, m/m and m."""
    scores: dict[str, Residuals]
    """By coefficient set and capture, in words."""


def identify(hand: JointedSimulator) -> Identification:
    """Sweep a hand and fit the map's coefficients; the mechanism's winding radii are the paper's."""
    paper = load_coefficients("paper")
    intervals = calibrated_range(hand)[list(FINGERS)]
    staircases = joined(staircase(hand, channel) for channel in THUMB)
    workspace = joined(thumb_grid(hand, abduction) for abduction in GRID_ABDUCTIONS)
    regression, inverse = fit_joints(staircases), fit_inverse(paper, staircases)
    identified = replace(
        paper,
        name="identified",
        source="aero-hil identify on this project's routed hand; winding radii as in 'paper'",
        finger_lengths=tuple(tuple(ends) for ends in intervals.tolist()),
        thumb_regression=tuple(tuple(row) for row in regression.coefficients.tolist()),
        thumb_gain=tuple(float(fit.coefficients[0, 0]) for fit in inverse),
        thumb_offset=tuple(float(fit.coefficients[0, 1]) for fit in inverse),
    )
    scores = {
        "identified, staircases (in sample)": score(identified, staircases),
        "identified, grids over abduction": score(identified, workspace),
        "paper, grids over abduction": score(paper, workspace),
    }
    return Identification(identified, regression, inverse, scores)


def fit_joints(capture: Capture) -> Fit:
    """Regress the thumb's three flexion angles; eq. (thumbfit). Abduction is left out where it was held."""
    columns = (*capture.lengths[:, THUMB].T, np.ones(len(capture.lengths)))
    held = np.ptp(columns[0]) < np.deg2rad(10.0)
    x = np.column_stack(columns[1:] if held else columns)
    return least_squares(x, capture.joints[:, FLEXION], capture.sweep)


def fit_inverse(coefficients: Coefficients, capture: Capture) -> tuple[Fit, Fit]:
    """Regress each cable's travel on the hand by its length in the simulator; eq. (thumbinv)."""
    # The simulator lacks the abduction term, which the map adds at run time.
    unabducted = capture.joints.copy()
    unabducted[:, Joint.THUMB_ABDUCTION] = 0.0
    travel = stages.travel_from_joints(coefficients, unabducted)
    ones = np.ones(len(capture.lengths))
    cmc, flexor = (
        least_squares(np.column_stack([capture.lengths[:, c], ones]), travel[:, [c]], capture.sweep) for c in CABLES
    )
    return cmc, flexor


def least_squares(x: Floats, targets: Floats, sweep: NDArray[np.int64]) -> Fit:
    """Fit `targets` (n, t) by `x` (n, k).

    Raises:
        ValueError: the regressors do not span their space, or a target is constant; something was not moved.
    """
    if np.linalg.matrix_rank(x / np.abs(x).max(axis=0)) < x.shape[1]:
        raise ValueError("the sweeps do not separate the coefficients; a channel was not moved on its own")
    spread = ((targets - targets.mean(axis=0)) ** 2).sum(axis=0)
    if not spread.all():
        raise ValueError(f"target {int(np.argmin(spread))} is constant; the sweeps did not move it")
    solution = np.asarray(np.linalg.lstsq(x, targets, rcond=None)[0], np.float64)
    residuals: Floats = targets - x @ solution
    # The residual of a first-order fit is misfit and not noise: it is correlated along a whole sweep. So the standard
    # errors are cluster-robust over sweeps (Liang and Zeger), with the usual factor for few clusters.
    inverse = np.linalg.inv(x.T @ x)
    labels = np.unique(sweep)
    by_sweep = np.stack([x[sweep == label].T @ residuals[sweep == label] for label in labels])
    middle = np.einsum("skt,slt->tkl", by_sweep, by_sweep) * len(labels) / (len(labels) - 1)
    errors = np.sqrt(np.einsum("ij,tjk,ki->ti", inverse, middle, inverse))
    return Fit(solution.T, errors, 1.0 - (residuals**2).sum(axis=0) / spread)


def score(coefficients: Coefficients, capture: Capture) -> Residuals:
    """Compare coefficients with a capture."""
    estimate = stages.thumb_joints_from_lengths(coefficients, capture.lengths)
    error = estimate - capture.joints[:, FLEXION]
    back = stages.lengths_from_travel(coefficients, stages.travel_from_lengths(coefficients, capture.lengths))
    trip = (back - capture.lengths)[:, CABLES]
    trip_joints = stages.thumb_joints_from_lengths(coefficients, back) - estimate
    return Residuals(_rms(error), _max(error), _rms(trip), _max(trip), _max(trip_joints))


def comparison(identification: Identification) -> list[Sequence[str]]:
    """Return a header and every identified number beside the paper's; the difference also in standard errors."""
    found, paper = identification.coefficients, load_coefficients("paper")
    rows: list[Sequence[str]] = [
        ("entry", "identified", "std. error", "paper", "difference", "std. errors"),
    ]

    def add(name: str, here: float, error: float, published: float, digits: int) -> None:
        off = f"{100.0 * (here / published - 1.0):+z.1f} %" if abs(published) > 0.01 else ""
        numbers = (f"{number:z.{digits}f}" for number in (here, error, published))
        rows.append((name, *numbers, off, f"{(here - published) / error:+z.1f}"))

    fit = identification.regression
    for i, joint in enumerate(("CMC", "MCP", "IP")):
        for j, column in enumerate(("abduction", "CMC cable", "flexor cable", "constant")):
            digits = 3 if j else 4
            here, error = fit.coefficients[i, j], fit.standard_errors[i, j]
            add(f"{joint} by {column}", here, error, paper.thumb_regression[i][j], digits)
    for i, cable in enumerate(("CMC", "flexor")):
        (gain, offset), (gain_error, offset_error) = (
            1e3 * identification.inverse[i].coefficients[0],
            1e3 * identification.inverse[i].standard_errors[0],
        )
        add(f"{cable} gain, mm/m", gain, gain_error, 1e3 * paper.thumb_gain[i], 1)
        add(f"{cable} offset, mm", offset, offset_error, 1e3 * paper.thumb_offset[i], 2)
    for finger in FINGERS:
        here, published = (1e3 * float(np.ptp(set_.finger_lengths[finger])) for set_ in (found, paper))
        numbers = (f"{here:.2f}", "", f"{published:.2f}", f"{here - published:+z.2f}", "")
        rows.append((f"{finger.label} excursion, mm", *numbers))
    return rows


def coefficient_toml(identification: Identification, side: str) -> str:
    """Return a file that `aero.actuation.load_coefficients` reads, provenance included.

    It depends on nothing but the model and MuJoCo's version: making it again shows what has changed.
    """
    c, fit = identification.coefficients, identification.regression
    finger = _inline(("mcp", "pip", "dip"), c.finger_winding)
    cmc, flexor = (_inline(("abduction", "cmc", "mcp", "ip"), row) for row in c.thumb_winding)
    return f"""\
# Coefficients of the actuation map, written by `aero-hil identify`. SI units: m, rad, and what follows.
name = "{c.name}"
source = "{c.source}"

[mechanism]
# Cable taken up per joint angle, m/rad; not identified: CAD, as in the coefficients 'paper'.
finger_winding = {finger}
thumb_cmc_winding = {cmc}
thumb_flexor_winding = {flexor}
spool_radius = {c.spool_radius!r}

[simulation]
# Shortest and longest settled finger cable: index, middle, ring, pinky; m.
finger_lengths = {_rows(c.finger_lengths)}
# Rows CMC, MCP, IP; columns abduction (rad/rad), CMC cable, flexor cable (rad/m), constant (rad).
thumb_regression = {_rows(c.thumb_regression)}
# Travel of the CMC and the flexor cable per simulated length, m/m, and offset, m.
thumb_gain = {list(c.thumb_gain)}
thumb_offset = {list(c.thumb_offset)}

[provenance]
hand = "routed, {side}"
mujoco = "{version("mujoco")}"
capture = "one channel at a time, {STAIRCASE_LEVELS} equal levels over the command range and back, \
{SAMPLES_A_LEVEL * SAMPLE_S:g} s a level, a sample every {SAMPLE_S:g} s, the others open"
thumb_regression_standard_errors = {_rows(fit.standard_errors)}
thumb_regression_r_squared = {[round(r, 7) for r in fit.r_squared.tolist()]}
thumb_gain_r_squared = {[round(float(f.r_squared[0]), 7) for f in identification.inverse]}
"""


def _rms(errors: Floats) -> Floats:
    rms: Floats = np.sqrt((errors**2).mean(axis=0))
    return rms


def _max(errors: Floats) -> Floats:
    largest: Floats = np.abs(errors).max(axis=0)
    return largest


def _inline(names: Sequence[str], values: Sequence[float]) -> str:
    return "{ " + ", ".join(f"{name} = {value!r}" for name, value in zip(names, values, strict=True)) + " }"


def _rows(matrix: Any) -> str:
    return "[\n" + "".join(f"  {[float(x) for x in row]},\n" for row in matrix) + "]"
