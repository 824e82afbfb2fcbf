"""Identification of the actuation map: sweep of the routed hand and fit (paper, section "The actuation map")."""

import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aero.actuation import ActuationMap
from aero.actuation.coefficients import Coefficients, load_coefficients
from aero.channels import FINGERS, THUMB, Channel, Joint
from aero.floats import Floats
from aero.side import Side
from aero.whole_file import write_whole
from hil.checks.staircase.reachable_range import calibrated_range
from simulator import RoutedHand

FLEXION = (Joint.THUMB_CMC, Joint.THUMB_MCP, Joint.THUMB_IP)
THUMB_CABLES = (Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR)
STAIRCASE_LEVELS = 20
SAMPLES_A_LEVEL = 24
SAMPLE_S = 0.02
"""Sample period, s, as in the paper's run."""
SETTLE_S = 1.5
"""Settling time after a move to an end of the range, s; the slowest joint needs less than a second."""


@dataclass(frozen=True)
class Capture:
    """Samples of a hand during sweeps of its channels."""

    lengths: Floats
    """(n, 7) sensor readings in command order: cable lengths, m, and abduction, rad."""
    joints: Floats
    """(n, 16) joint angles, rad."""
    sweep: NDArray[np.int64]
    """(n,) sweep number of each sample; errors within a sweep are not independent."""


@dataclass(frozen=True)
class Fit:
    """Least-squares fit of several targets."""

    coefficients: Floats
    """Coefficients, (targets, regressors)."""
    standard_errors: Floats
    """Standard errors, (targets, regressors), robust against correlation within a sweep."""
    r_squared: Floats
    """Coefficient of determination, (targets,)."""


@dataclass(frozen=True)
class Identification:
    """Coefficients of the map, with their fits."""

    coefficients: Coefficients
    """Identified coefficients with the mechanism's own winding radii."""
    regression: Fit
    """Regression matrix C of the thumb's flexion angles, (3, 4)."""
    inverse: tuple[Fit, Fit]
    """Gain, m/m, and offset, m, of the CMC and the flexor cable's travel over the cable's length."""
    staircases: Capture
    """Samples behind the fit."""


def identify(routed: RoutedHand) -> Identification:
    """Sweep a hand and fit the map's coefficients; the mechanism's winding radii are the paper's."""
    paper = load_coefficients("paper")
    intervals = calibrated_range(routed)[list(FINGERS)]
    staircases = joined(staircase(routed, channel) for channel in THUMB)
    regression, inverse = fit_joints(staircases), fit_inverse(paper, staircases)
    identified = replace(
        paper,
        name="identified",
        source="train.identification.map_identification on this project's routed hand; winding radii as in 'paper'",
        finger_lengths=tuple(tuple(ends) for ends in intervals.tolist()),
        thumb_regression=tuple(tuple(row) for row in regression.coefficients.tolist()),
        thumb_gain=tuple(float(fit.coefficients[0, 0]) for fit in inverse),
        thumb_offset=tuple(float(fit.coefficients[0, 1]) for fit in inverse),
    )
    return Identification(identified, regression, inverse, staircases)


def joined(captures: Iterable[Capture]) -> Capture:
    """Return several captures as one, with unique sweep numbers."""
    parts = list(captures)
    offsets = np.cumsum([0, *(part.sweep.max() + 1 for part in parts)])[:-1]
    return Capture(
        np.concatenate([part.lengths for part in parts]),
        np.concatenate([part.joints for part in parts]),
        np.concatenate([part.sweep + offset for part, offset in zip(parts, offsets, strict=True)]),
    )


def staircase(routed: RoutedHand, channel: Channel) -> Capture:
    """Step one channel over its command range and back in 20 equal levels, the others open; 50 samples a second."""
    goal = open_command(routed)
    opened, closed = ends(routed, channel)
    rise = np.linspace(opened, closed, STAIRCASE_LEVELS + 1)
    goal[channel] = opened
    routed.command(goal)
    routed.advance(SETTLE_S)
    samples = []
    for level in (*rise, *rise[::-1]):
        goal[channel] = level
        routed.command(goal)
        for _ in range(SAMPLES_A_LEVEL):
            routed.advance(SAMPLE_S)
            samples.append((routed.lengths(), routed.joint_angles()))
    return captured(samples)


def open_command(routed: RoutedHand) -> Floats:
    """Reset the hand and return the command that holds it open."""
    routed.reset()
    return np.clip(routed.lengths(), *routed.command_range.T)


def ends(routed: RoutedHand, channel: Channel) -> tuple[float, float]:
    """Return a channel's commands at the open and the closed end, m or rad."""
    low, high = routed.command_range[channel]
    return (low, high) if channel == Channel.THUMB_ABDUCTION else (high, low)


def captured(samples: list[tuple[Floats, Floats]]) -> Capture:
    """Return the samples of one sweep, lengths (7,) and joints (16,), as a capture."""
    lengths, joints = zip(*samples, strict=True)
    return Capture(np.array(lengths), np.array(joints), np.zeros(len(samples), np.int64))


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
    travel = ActuationMap(coefficients).travel_from_joints(unabducted)
    ones = np.ones(len(capture.lengths))
    cmc, flexor = (
        least_squares(np.column_stack([capture.lengths[:, c], ones]), travel[:, [c]], capture.sweep)
        for c in THUMB_CABLES
    )
    return cmc, flexor


def least_squares(x: Floats, targets: Floats, sweep: NDArray[np.int64]) -> Fit:
    """Fit `targets` (n, t) by `x` (n, k).

    Raises:
        ValueError: the regressors are linearly dependent, or a target is constant; a channel did not move.
    """
    if np.linalg.matrix_rank(x / np.abs(x).max(axis=0)) < x.shape[1]:
        raise ValueError("the sweeps do not separate the coefficients; a channel was not moved on its own")
    spread = ((targets - targets.mean(axis=0)) ** 2).sum(axis=0)
    if not spread.all():
        raise ValueError(f"target {int(np.argmin(spread))} is constant; the sweeps did not move it")
    solution = np.asarray(np.linalg.lstsq(x, targets, rcond=None)[0], np.float64)
    residuals: Floats = targets - x @ solution
    # The residual of a first-order fit is misfit instead of noise, correlated along a whole sweep. The standard errors
    # are therefore cluster-robust over sweeps (Liang and Zeger), with the usual factor for few clusters.
    inverse = np.linalg.inv(x.T @ x)
    labels = np.unique(sweep)
    by_sweep = np.stack([x[sweep == label].T @ residuals[sweep == label] for label in labels])
    middle = np.einsum("skt,slt->tkl", by_sweep, by_sweep) * len(labels) / (len(labels) - 1)
    errors = np.sqrt(np.einsum("ij,tjk,ki->ti", inverse, middle, inverse))
    return Fit(solution.T, errors, 1.0 - (residuals**2).sum(axis=0) / spread)


def comparison(identification: Identification) -> list[Sequence[str]]:
    """Return a table of the identified numbers beside the paper's, with the differences in standard errors."""
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
    """Return the content of a file for `aero.actuation.load_coefficients`, with provenance.

    The content depends only on the model and MuJoCo's version, so a repeated run shows changes of either.
    """
    c, fit = identification.coefficients, identification.regression
    finger = _inline(("mcp", "pip", "dip"), c.finger_winding)
    cmc, flexor = (_inline(("abduction", "cmc", "mcp", "ip"), row) for row in c.thumb_winding)
    return f"""\
# Coefficients of the actuation map. SI units: m, rad, and what follows.
# Written by `python -m train.identification.map_identification`.
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


def _inline(names: Sequence[str], values: Sequence[float]) -> str:
    return "{ " + ", ".join(f"{name} = {value!r}" for name, value in zip(names, values, strict=True)) + " }"


def _rows(matrix: Any) -> str:
    return "[\n" + "".join(f"  {[float(x) for x in row]},\n" for row in matrix) + "]"


def main() -> None:
    """Fit the map to a routed hand, print the fit beside the paper's, and write `coefficients.toml`.

    The only argument is the side, by default `right`. The file is an argument of
    `ActuationMap.for_firmware(..., coefficients=FILE)`.
    """
    side: Side = "left" if sys.argv[1:] == ["left"] else "right"
    result = identify(RoutedHand(side))
    write_whole(Path("coefficients.toml"), coefficient_toml(result, side))
    for entry, *cells in comparison(result):
        print(f"{entry:26}", *(f"{cell:>11}" for cell in cells))
    print(f"R² (CMC, MCP, IP): {', '.join(f'{value:.5f}' for value in result.regression.r_squared)}")


if __name__ == "__main__":
    main()
