"""The paper's thumb figure: both sweeps with their fits, and what the deployed coefficients leave."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from aero.actuation import stages
from aero.actuation.coefficients import Coefficients, load_coefficients
from aero.channels import Channel, Joint
from aero.whole_file import whole
from hil.lab.map_identification.captures import GRID_LEVELS, Capture
from hil.lab.map_identification.identify import FLEXION, Floats, Identification

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_CMC, _FLEXOR = Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR
_MARKERS = ("o", "s")


def draw_thumb_figure(identification: Identification, path: Path) -> None:
    """Write the figure as PNG, SVG or PDF, by the suffix of `path`.

    (a) CMC joint against its cable, one shade a level of the flexor cable; (b) MCP joint against the flexor cable, one
    shade a level of the CMC cable; lines are the bilinear fit; (c) and (d) what the published and the identified
    coefficients leave on this grid, which neither was identified on.
    """
    grid = identification.captures["grid"]
    fit = identification.alternatives["bilinear"]["grid"]
    fitted = grid.joints[:, FLEXION] - fit.residuals
    figure = Figure(figsize=(11.0, 7.6), layout="constrained")
    (cmc_axes, mcp_axes), (paper_axes, own_axes) = figure.subplots(2, 2)
    _panel(figure, cmc_axes, grid, Joint.THUMB_CMC, fitted[:, 0])
    _panel(figure, mcp_axes, grid, Joint.THUMB_MCP, fitted[:, 1])
    cmc_axes.set(title="(a) CMC flexion joint", xlabel="CMC flexion cable [mm]", ylabel="angle [rad]")
    mcp_axes.set(title="(b) MCP joint (IP coincides)", xlabel="flexor cable [mm]", ylabel="angle [rad]")
    limit_mrad = 1e3 * max(
        np.abs(_residuals(set_, grid)).max() for set_ in (load_coefficients("paper"), identification.coefficients)
    )
    for axes, letter, set_ in (
        (paper_axes, "c", load_coefficients("paper")),
        (own_axes, "d", identification.coefficients),
    ):
        residuals_mrad = 1e3 * _residuals(set_, grid)
        for i, (name, cable) in enumerate((("CMC", _CMC), ("MCP", _FLEXOR))):
            rms = np.sqrt((residuals_mrad[:, i] ** 2).mean())
            stroke = _stroke(grid.lengths[:, cable])
            axes.plot(stroke, residuals_mrad[:, i], _MARKERS[i], ms=4, alpha=0.7, label=f"{name}, rms {rms:.1f} mrad")
        axes.axhline(0.0, color="black", lw=0.8)
        axes.set(
            title=f"({letter}) residuals of the coefficients '{set_.name}'",
            xlabel="own cable, open to closed [share of its sweep]",
            ylabel="estimate - simulator [mrad]",
            ylim=(-1.1 * limit_mrad, 1.1 * limit_mrad),
        )
        axes.legend(loc="upper left")
    # Fixed identifiers and no date, so that the same result is the same file.
    with mpl.rc_context({"svg.hashsalt": "thumb"}), whole(path) as draft:
        figure.savefig(draft, dpi=150, metadata={"Date": None} if path.suffix == ".svg" else None)


def _panel(figure: Figure, axes: Axes, grid: Capture, joint: Joint, fitted: Floats) -> None:
    """Draw one joint against its own cable, a curve a level of the other; the cable shortens to the right."""
    cable, other = (_CMC, _FLEXOR) if joint == Joint.THUMB_CMC else (_FLEXOR, _CMC)
    lengths, others, angles, model = (
        values.reshape(GRID_LEVELS, GRID_LEVELS)
        for values in (grid.lengths[:, cable], grid.lengths[:, other], grid.joints[:, joint], fitted)
    )
    if other == _FLEXOR:
        # The grid's rows are levels of the CMC cable.
        lengths, others, angles, model = lengths.T, others.T, angles.T, model.T
    shades = mpl.colormaps["viridis"].resampled(GRID_LEVELS + 1)
    levels_mm = 1e3 * others.mean(axis=1)
    scale = mpl.colors.Normalize(levels_mm.min(), levels_mm.max())
    for row in range(GRID_LEVELS):
        shade = shades(scale(levels_mm[row]))
        axes.plot(1e3 * lengths[row], angles[row], "o", ms=3.5, color=shade)
        axes.plot(1e3 * lengths[row], model[row], "-", lw=1.0, color=shade)
    axes.invert_xaxis()
    name = "flexor" if other == _FLEXOR else "CMC flexion"
    figure.colorbar(mpl.cm.ScalarMappable(scale, shades), ax=axes, label=f"{name} cable, mean of its level [mm]")


def _residuals(coefficients: Coefficients, grid: Capture) -> Floats:
    residuals: Floats = stages.thumb_joints_from_lengths(coefficients, grid.lengths) - grid.joints[:, FLEXION]
    return residuals


def _stroke(lengths: Floats) -> Floats:
    share: Floats = (lengths.max() - lengths) / np.ptp(lengths)
    return share
