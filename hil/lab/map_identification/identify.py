"""From a simulated hand to the coefficients of its actuation map, and how good they are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aero.actuation import stages
from aero.actuation.coefficients import Coefficients, load_coefficients
from aero.channels import FINGERS, Channel, Joint
from hil.checks.staircase.reachable_range import calibrated_range
from hil.lab.map_identification.captures import (
    Capture,
    JointedSimulator,
    joined,
    thumb_grid,
    thumb_staircases,
)
from hil.lab.map_identification.regression import DESIGNS, Fit, least_squares, regressors

Floats = NDArray[np.float64]

FLEXION = (Joint.THUMB_CMC, Joint.THUMB_MCP, Joint.THUMB_IP)
CABLES = (Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR)
HELD_ABDUCTION = 0.75
"""Abduction while the cables' grid is swept, rad; the policy's nominal grasp."""
GRID_ABDUCTIONS = (0.0, 0.35, 0.7, 1.05, 1.4, 1.7)
"""Where the grid is repeated to cover the workspace, rad."""
AT_LIMIT_RAD = 0.02
"""An MCP angle below this counts as resting on its extended limit."""


@dataclass(frozen=True)
class Residuals:
    """How far coefficients are from what the simulator did; the last axis is CMC, MCP, IP or the two cables."""

    joints_rms_rad: Floats
    """(3,) estimated against true joint angles."""
    joints_max_rad: Floats
    """(3,)."""
    round_trip_rms_m: Floats
    """(2,) forward and inverse map composed, simulator length to travel to simulator length."""
    round_trip_max_m: Floats
    """(2,)."""
    round_trip_max_rad: Floats
    """(3,) the same, seen in the estimated joint angles."""


@dataclass(frozen=True)
class Identification:
    """The result; captures included, so that figures show what the numbers were made of."""

    coefficients: Coefficients
    """What was identified, on the mechanism's own winding radii."""
    regression: Fit
    """C, (3, 4)."""
    inverse: tuple[Fit, Fit]
    """Travel of the CMC and the flexor cable by its own length and a constant, m/m and m."""
    alternatives: dict[str, dict[str, Fit]]
    """Design to fit, on each capture."""
    captures: dict[str, Capture]
    """`staircases` (identified on), `grid` (abduction held) and `workspace` (grids over abduction)."""
    scores: dict[str, dict[str, Residuals]]
    """Coefficient set to capture to residuals."""


def identify(hand: JointedSimulator, progress: Callable[[str], None] = lambda _: None) -> Identification:
    """Sweep a hand and fit the map's coefficients; the mechanism's winding radii are the paper's.

    Args:
        hand: the simulated hand.
        progress: told what is being done.
    """
    paper = load_coefficients("paper")
    progress("finger sweeps")
    intervals = calibrated_range(hand)[list(FINGERS)]
    progress("thumb staircases")
    staircases = thumb_staircases(hand)
    progress("thumb grids over abduction")
    captures = {
        "staircases": staircases,
        "grid": thumb_grid(hand, HELD_ABDUCTION),
        "workspace": joined(thumb_grid(hand, abduction) for abduction in GRID_ABDUCTIONS),
    }
    progress("fits")
    regression = fit_joints("first order", staircases)
    inverse = fit_inverse(paper, staircases)
    identified = replace(
        paper,
        name="identified",
        source="aero-hil identify on this project's routed hand; winding radii as in 'paper'",
        finger_lengths=tuple(tuple(ends) for ends in intervals.tolist()),
        thumb_regression=tuple(tuple(row) for row in regression.coefficients.tolist()),
        thumb_gain=tuple(float(fit.coefficients[0, 0]) for fit in inverse),
        thumb_offset=tuple(float(fit.coefficients[0, 1]) for fit in inverse),
    )
    return Identification(
        coefficients=identified,
        regression=regression,
        inverse=inverse,
        alternatives={
            design: {name: fit_joints(design, capture) for name, capture in captures.items()} for design in DESIGNS
        },
        captures=captures,
        scores={
            set_.name: {name: score(set_, capture) for name, capture in captures.items()}
            for set_ in (identified, paper)
        },
    )


def fit_joints(design: str, capture: Capture) -> Fit:
    """Regress the thumb's three flexion angles; eq. (thumbfit) for the first-order design."""
    return least_squares(regressors(design, capture), capture.joints[:, FLEXION], capture.sweep)


def fit_inverse(coefficients: Coefficients, capture: Capture) -> tuple[Fit, Fit]:
    """Regress each cable's travel on the hand by its length in the simulator; eq. (thumbinv).

    The travel is that of the simulator's own joint angles, less the abduction term, which the simulator lacks and
    the map adds at run time.
    """
    unabducted = capture.joints.copy()
    unabducted[:, Joint.THUMB_ABDUCTION] = 0.0
    travel = stages.travel_from_joints(coefficients, unabducted)
    ones = np.ones(len(capture.lengths))
    cmc, flexor = (
        least_squares(np.column_stack([capture.lengths[:, c], ones]), travel[:, [c]], capture.sweep) for c in CABLES
    )
    return cmc, flexor


def score(coefficients: Coefficients, capture: Capture) -> Residuals:
    """Compare coefficients with a capture."""
    estimate = stages.thumb_joints_from_lengths(coefficients, capture.lengths)
    error = estimate - capture.joints[:, FLEXION]
    back = stages.lengths_from_travel(coefficients, stages.travel_from_lengths(coefficients, capture.lengths))
    trip = (back - capture.lengths)[:, CABLES]
    trip_joints = stages.thumb_joints_from_lengths(coefficients, back) - estimate
    return Residuals(_rms(error), _max(error), _rms(trip), _max(trip), _max(trip_joints))


def first_order_off_limit(capture: Capture) -> Fit:
    """Fit only the samples whose MCP joint is off its extended limit.

    At the limit the CMC cable cannot move the joint, off it it does: no first-order map does both.
    """
    off = capture.joints[:, Joint.THUMB_MCP] > AT_LIMIT_RAD
    return fit_joints("first order", Capture(capture.lengths[off], capture.joints[off], capture.sweep[off]))


def spread_over_cmc_levels(grid: Capture, levels: int) -> Floats:
    """Return how far the MCP angle spreads over the CMC cable's levels at each flexor level, (levels,) rad."""
    spread: Floats = np.ptp(grid.joints[:, Joint.THUMB_MCP].reshape(levels, levels), axis=0)
    return spread


def _rms(errors: Floats) -> Floats:
    rms: Floats = np.sqrt((errors**2).mean(axis=0))
    return rms


def _max(errors: Floats) -> Floats:
    largest: Floats = np.abs(errors).max(axis=0)
    return largest
