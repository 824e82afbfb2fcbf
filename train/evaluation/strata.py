"""Where a policy works and where it stops working: by friction, mass and side of the cube, and by hand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from aero.whole_file import whole
from train.evaluation.cube_trial import CubeTrial
from train.evaluation.trial_set import TURNS_RAD_S, TrialSet, trial_set_of


@dataclass(frozen=True)
class Division:
    """One thing by which trials are divided."""

    name: str
    """For people, with the unit of the edges."""
    edges: tuple[float, ...]
    """Edges of the strata, lowest first, in that unit; the last stratum is the tail of `model.cubes`."""
    value: Callable[[CubeTrial], float]
    """Gives a trial's, in that unit."""

    def divided(self, trials: Sequence[CubeTrial]) -> list[list[CubeTrial]]:
        """Return the trials of each stratum."""
        strata: list[list[CubeTrial]] = [[] for _ in self.edges[1:]]
        for trial in trials:
            strata[int(np.digitize(self.value(trial), self.edges[1:-1]))].append(trial)
        return strata

    def labels(self) -> list[str]:
        """Return the name of each stratum."""
        return [f"{self.name} {low:g} to {high:g}" for low, high in zip(self.edges, self.edges[1:], strict=False)]


DIVISIONS = (
    Division("friction", (0.3, 0.5, 0.8, 1.0), lambda trial: trial.surroundings.cube.friction),
    Division("mass, g,", (40.0, 75.0, 110.0, 140.0), lambda trial: 1e3 * trial.surroundings.cube.mass_kg),
    Division("side, mm,", (45.0, 49.0, 52.0, 55.0), lambda trial: 1e3 * trial.surroundings.cube.side_m),
)


def strata(trials: Sequence[CubeTrial]) -> list[TrialSet]:
    """Return what all trials came to, then each stratum of each division, then each hand."""
    found = [trial_set_of("all", trials)]
    for division in DIVISIONS:
        parts = zip(division.labels(), division.divided(trials), strict=True)
        found += [trial_set_of(label, part) for label, part in parts]
    for side in ("right", "left"):
        found.append(trial_set_of(f"{side} hand", [one for one in trials if one.surroundings.side == side]))
    return found


def strata_picture(trials: Sequence[CubeTrial], path: Path) -> None:
    """Draw rate and share kept of each stratum, with the single trials behind."""
    figure = Figure(figsize=(11, 6), layout="constrained")
    grid = figure.subplots(2, len(DIVISIONS), sharex="col", sharey="row")
    for (rate, kept), division in zip(grid.T, DIVISIONS, strict=True):
        for wanted, mark, colour, label in ((True, ".", "tab:blue", "kept"), (False, "x", "tab:red", "lost")):
            those = [one for one in trials if one.kept is wanted]
            values = [division.value(one) for one in those]
            rate.plot(values, [one.rate_rad_s for one in those], mark, color=colour, alpha=0.5, label=label)
        for low, high, part in zip(division.edges, division.edges[1:], division.divided(trials), strict=False):
            if part:
                own = trial_set_of("", part)
                rate.plot([low, high], [own.rate_rad_s] * 2, color="black")
                kept.plot([low, high], [own.kept_share] * 2, color="black")
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
