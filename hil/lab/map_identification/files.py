"""What an identification leaves behind: a coefficient file that says where it comes from, and a report."""

from __future__ import annotations

from dataclasses import asdict
from importlib.metadata import version
from typing import Any

import numpy as np

from aero.actuation.coefficients import load_coefficients
from aero.channels import FINGERS
from hil.lab.map_identification.captures import GRID_LEVELS, SAMPLE_S, SAMPLES_A_LEVEL, STAIRCASE_LEVELS
from hil.lab.map_identification.identify import Identification, first_order_off_limit, spread_over_cmc_levels

_FINGER_JOINTS = ("mcp", "pip", "dip")
_THUMB_JOINTS = ("abduction", "cmc", "mcp", "ip")


def coefficient_toml(identification: Identification, side: str) -> str:
    """Return a file that `aero.actuation.load_coefficients` reads, provenance included.

    The file depends on nothing but the model and MuJoCo's version, so that making it again shows what has changed.
    """
    c = identification.coefficients
    fit = identification.regression
    finger = _inline(dict(zip(_FINGER_JOINTS, c.finger_winding, strict=True)))
    cmc, flexor = (_inline(dict(zip(_THUMB_JOINTS, row, strict=True))) for row in c.thumb_winding)
    protocol = (
        f"one channel at a time, {STAIRCASE_LEVELS} equal levels over the command range and back, "
        f"{SAMPLES_A_LEVEL * SAMPLE_S:g} s a level, a sample every {SAMPLE_S:g} s, the others open"
    )
    return "\n".join(
        [
            "# Coefficients of the actuation map, written by `aero-hil identify`. SI units: m, rad, and what follows.",
            f'name = "{c.name}"',
            f'source = "{c.source}"',
            "",
            "[mechanism]",
            "# Cable taken up per joint angle, m/rad; not identified: CAD, as in the coefficients 'paper'.",
            f"finger_winding = {finger}",
            f"thumb_cmc_winding = {cmc}",
            f"thumb_flexor_winding = {flexor}",
            f"spool_radius = {c.spool_radius!r}",
            "",
            "[simulation]",
            "# Shortest and longest settled finger cable: index, middle, ring, pinky; m.",
            f"finger_lengths = {_rows(c.finger_lengths)}",
            "# Rows CMC, MCP, IP; columns abduction (rad/rad), CMC cable, flexor cable (rad/m), constant (rad).",
            f"thumb_regression = {_rows(c.thumb_regression)}",
            "# Travel of the CMC and the flexor cable per simulated length, m/m, and offset, m.",
            f"thumb_gain = {list(c.thumb_gain)}",
            f"thumb_offset = {list(c.thumb_offset)}",
            "",
            "[provenance]",
            f'hand = "routed, {side}"',
            f'mujoco = "{version("mujoco")}"',
            f'capture = "{protocol}"',
            f"thumb_regression_standard_errors = {_rows(fit.standard_errors)}",
            f"thumb_regression_r_squared = {[round(r, 7) for r in fit.r_squared.tolist()]}",
            f"thumb_gain_r_squared = {[round(float(f.r_squared[0]), 7) for f in identification.inverse]}",
            "",
        ]
    )


def report(identification: Identification) -> dict[str, Any]:
    """Return everything that was found as plain numbers: fits, residuals in and out of sample, against the paper."""
    paper = load_coefficients("paper")
    fit = identification.regression
    published = np.array(paper.thumb_regression)
    difference = fit.coefficients - published
    at_limit_excluded = first_order_off_limit(identification.captures["grid"])
    return {
        "identified_on": "staircases",
        "coefficients": _plain(identification.coefficients),
        "against_paper": {
            "regression_percent": (100.0 * difference / published).tolist(),
            "regression_standard_errors_off": (np.abs(difference) / fit.standard_errors).tolist(),
            "gain_percent": (
                100.0 * (np.divide(identification.coefficients.thumb_gain, paper.thumb_gain) - 1)
            ).tolist(),
            "offset_mm": (1e3 * np.subtract(identification.coefficients.thumb_offset, paper.thumb_offset)).tolist(),
            "finger_excursion_mm": {
                "identified": (1e3 * np.ptp(identification.coefficients.finger_lengths, axis=1)).tolist(),
                "paper": (1e3 * np.ptp(paper.finger_lengths, axis=1)).tolist(),
            },
        },
        "first_order": {
            name: {"regression": f.coefficients.tolist(), "standard_errors": f.standard_errors.tolist()}
            for name, f in identification.alternatives["first order"].items()
        },
        "r_squared": {
            design: {name: f.r_squared.tolist() for name, f in fits.items()}
            for design, fits in identification.alternatives.items()
        },
        "inverse_r_squared": [float(f.r_squared[0]) for f in identification.inverse],
        "residuals": {
            name: {capture: _plain(score) for capture, score in scores.items()}
            for name, scores in identification.scores.items()
        },
        "saturation": {
            "mcp_spread_over_cmc_levels_rad": spread_over_cmc_levels(
                identification.captures["grid"], GRID_LEVELS
            ).tolist(),
            "grid_rms_rad": np.sqrt(
                (identification.alternatives["first order"]["grid"].residuals ** 2).mean(axis=0)
            ).tolist(),
            "grid_rms_without_limit_rad": np.sqrt((at_limit_excluded.residuals**2).mean(axis=0)).tolist(),
        },
    }


def table(identification: Identification) -> list[tuple[str, str, str, str]]:
    """Return name, identified, paper and difference of every identified number, for people."""
    paper, found = load_coefficients("paper"), identification.coefficients
    errors = identification.regression.standard_errors
    rows = []
    for i, joint in enumerate(("CMC", "MCP", "IP")):
        for j, column in enumerate(("abduction", "CMC cable", "flexor cable", "constant")):
            ours, theirs, error = found.thumb_regression[i][j], paper.thumb_regression[i][j], errors[i, j]
            off = f"{100 * (ours / theirs - 1):+.1f} %, {abs(ours - theirs) / error:.1f} standard errors"
            rows.append((f"{joint} by {column}", f"{ours:.5g} ± {error:.2g}", f"{theirs:.5g}", off))
    for i, cable in enumerate(("CMC", "flexor")):
        ours, theirs = found.thumb_gain[i], paper.thumb_gain[i]
        rows.append(
            (f"{cable} gain, mm/m", f"{1e3 * ours:.1f}", f"{1e3 * theirs:.1f}", f"{100 * (ours / theirs - 1):+.2f} %")
        )
        ours, theirs = found.thumb_offset[i], paper.thumb_offset[i]
        rows.append(
            (f"{cable} offset, mm", f"{1e3 * ours:.2f}", f"{1e3 * theirs:.2f}", f"{1e3 * (ours - theirs):+.2f} mm")
        )
    for finger, ours_ends, their_ends in zip(FINGERS, found.finger_lengths, paper.finger_lengths, strict=True):
        ours, theirs = np.ptp(ours_ends) * 1e3, np.ptp(their_ends) * 1e3
        rows.append((f"{finger.label} excursion, mm", f"{ours:.2f}", f"{theirs:.2f}", f"{ours - theirs:+.2f} mm"))
    return rows


def _plain(data: Any) -> Any:
    values = asdict(data)
    return {key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in values.items()}


def _inline(values: dict[str, float]) -> str:
    return "{ " + ", ".join(f"{key} = {value!r}" for key, value in values.items()) + " }"


def _rows(matrix: Any) -> str:
    return "[\n" + "".join(f"  {[float(x) for x in row]},\n" for row in matrix) + "]"
