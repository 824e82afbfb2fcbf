"""Where a policy works and where it stops working: by friction, mass and side of the cube, and by hand."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from aero.whole_file import whole
from hil.lab.policies.byte_evaluation import TURNS_RAD_S
from hil.lab.policies.cube_trial import CubeTrial
from hil.lab.policies.prediction import Interval, share
from model.cubes import PROPERTIES, Property
from model.scene import CUBE


@dataclass(frozen=True)
class Division:
    """One thing by which trials are divided."""

    name: str
    """For people, with the unit of the edges."""
    edges: tuple[float, ...]
    """Edges of the strata, lowest first, in that unit."""
    value: Callable[[CubeTrial], float]
    """Gives a trial's, in that unit."""

    def label(self, stratum: int) -> str:
        """Return a stratum for tables."""
        return f"{self.name} {self.edges[stratum]:g} to {self.edges[stratum + 1]:g}"


DIVISIONS = (
    Division("friction", (0.3, 0.5, 0.8, 1.0), lambda trial: trial.surroundings.cube.friction),
    Division("mass, g,", (40.0, 75.0, 110.0, 140.0), lambda trial: 1e3 * trial.surroundings.cube.mass_kg),
    Division("side, mm,", (45.0, 49.0, 52.0, 55.0), lambda trial: 1e3 * trial.surroundings.cube.side_m),
)
"""The upper strata are the tails of `model.cubes`."""


@dataclass(frozen=True)
class Stratum:
    """What the trials of a stratum came to; intervals of 95 %, Wilson's."""

    label: str
    trials: int
    kept: float
    kept_interval: Interval
    rate_rad_s: float
    """Mean; NaN without trials."""
    turned: float
    """Share above `byte_evaluation.TURNS_RAD_S`."""
    turned_interval: Interval


def stratum(label: str, trials: Sequence[CubeTrial]) -> Stratum:
    """Return what these trials came to."""
    kept, kept_interval = share([one.kept for one in trials])
    turned, turned_interval = share([one.rate_rad_s > TURNS_RAD_S for one in trials])
    rate = float(np.mean([one.rate_rad_s for one in trials])) if trials else np.nan
    return Stratum(label, len(trials), kept, kept_interval, rate, turned, turned_interval)


def strata(trials: Sequence[CubeTrial]) -> list[Stratum]:
    """Return all trials, then those of each stratum of each division, then those of each hand."""
    found = [stratum("all", trials)]
    for division in DIVISIONS:
        places = np.digitize([division.value(one) for one in trials], division.edges[1:-1])
        for place in range(len(division.edges) - 1):
            own = [one for one, its in zip(trials, places, strict=True) if its == place]
            found.append(stratum(division.label(place), own))
    for side in ("right", "left"):
        found.append(stratum(f"{side} hand", [one for one in trials if one.surroundings.side == side]))
    return found


def strata_picture(trials: Sequence[CubeTrial], path: Path) -> None:
    """Draw rate and share kept of each stratum, with the single trials behind."""
    figure = Figure(figsize=(11, 6), layout="constrained")
    grid = figure.subplots(2, len(DIVISIONS), sharex="col", sharey="row")
    for (rate, kept), division in zip(grid.T, DIVISIONS, strict=True):
        values = np.array([division.value(one) for one in trials])
        lost = np.array([not one.kept for one in trials])
        rates = np.array([one.rate_rad_s for one in trials])
        rate.plot(values[~lost], rates[~lost], ".", color="tab:blue", alpha=0.4, label="kept")
        rate.plot(values[lost], rates[lost], "x", color="tab:red", label="lost")
        places = np.digitize(values, division.edges[1:-1])
        for place, (low, high) in enumerate(zip(division.edges, division.edges[1:], strict=False)):
            own = stratum("", [one for one, its in zip(trials, places, strict=True) if its == place])
            if own.trials:
                rate.plot([low, high], [own.rate_rad_s] * 2, color="black")
                kept.plot([low, high], [own.kept] * 2, color="black")
                kept.fill_between([low, high], *own.kept_interval, alpha=0.25, linewidth=0, color="tab:blue")
        rate.axhline(TURNS_RAD_S, color="grey", linestyle=":", linewidth=0.8)
        kept.set_xlabel(division.name.strip(","))
    grid[0, 0].set_ylabel("rate, rad/s")
    grid[0, 0].legend(frameon=False)
    grid[1, 0].set_ylabel("share that keeps the cube")
    grid[1, 0].set_ylim(-0.02, 1.02)
    figure.suptitle("Any cube on any hand through every byte; lines: means, bands: 95 % intervals", fontsize="medium")
    with whole(path) as draft:
        figure.savefig(draft, dpi=120)


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
