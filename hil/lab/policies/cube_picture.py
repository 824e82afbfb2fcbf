"""A picture of how a policy does with other cubes: rate and share kept against each property."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from aero.whole_file import whole
from model.cubes import PROPERTIES, Property
from model.scene import CUBE

Figures = Mapping[str, Mapping[str, float]]


def cube_picture(rows: Figures, path: Path) -> None:
    """Draw the figures of `byte_evaluation.over_cubes`, as far as they were made, to `path`."""
    figure = Figure(figsize=(11, 5), layout="constrained")
    grid = figure.subplots(2, len(PROPERTIES), sharex="col", sharey="row")
    for (rate, kept), one in zip(grid.T, PROPERTIES, strict=True):
        made = [value for value in one.values if one.label(value) in rows]
        shown = [rows[one.label(value)] for value in made]
        x = np.array(made) * one.scale
        for axes, key in ((rate, "rate_rad_s"), (kept, "survival")):
            y = np.array([row[key] for row in shown])
            ends = np.array([[row[f"{key}_low"], row[f"{key}_high"]] for row in shown]).reshape(-1, 2)
            axes.errorbar(x, y, yerr=np.abs(ends.T - y), marker="o", capsize=3)
            axes.axvline(_of_the_paper(one), color="grey", linestyle=":", linewidth=0.8)
            axes.grid(alpha=0.3)
        kept.set_xlabel(f"{one.name}{', ' if one.unit else ''}{one.unit}")
    grid[0, 0].set_ylabel("rate, rad/s")
    grid[1, 0].set_ylabel("share that keeps the cube")
    grid[1, 0].set_ylim(-0.02, 1.02)
    figure.suptitle("Other cubes, one property at a time; 95 % intervals; dotted: the paper's cube", fontsize="medium")
    with whole(path) as draft:
        figure.savefig(draft, dpi=120)


def _of_the_paper(one: Property) -> float:
    """Return the value that the paper's cube has, as shown."""
    return next(value for value in one.values if one.change(CUBE, value) == CUBE) * one.scale
