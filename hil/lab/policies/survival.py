"""How long a policy keeps the cube: the paper's rollout of 50 s, and ten minutes of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from aero.whole_file import whole
from hil.lab.policies.cube_trial import CubeTrial
from hil.lab.policies.prediction import Interval, share

LONG_S = 600.0
"""Length of a trial, s."""
MOMENTS_S = (15.0, 50.0, 200.0, LONG_S)
"""After which it is said how many still hold the cube: a trial of `evaluate`, the paper's rollout, and longer."""


@dataclass(frozen=True)
class StillHeld:
    """Trials that still hold the cube after a time."""

    after_s: float
    share: float
    interval: Interval
    """Wilson's interval of the share."""


def still_held(trials: Sequence[CubeTrial], moments_s: Sequence[float] = MOMENTS_S) -> list[StillHeld]:
    """Return how many of the trials, all of one length, hold the cube after each time up to it."""
    return [StillHeld(t, *share([one.kept or one.alive_s > t for one in trials])) for t in moments_s]


def survival_picture(rows: Mapping[str, Sequence[CubeTrial]], path: Path) -> None:
    """Draw the share of trials of each row that still hold the cube against the time."""
    figure = Figure(figsize=(8, 4), layout="constrained")
    axes = figure.subplots()
    for number, (name, trials) in enumerate(rows.items()):
        lost_s = np.sort([one.alive_s for one in trials if not one.kept])
        times_s = np.concatenate([[0.0], lost_s, [LONG_S]])
        holding = 1.0 - np.arange(len(lost_s) + 1) / len(trials)
        axes.step(times_s, [*holding, holding[-1]], where="post", label=f"{name}, {len(trials)} trials")
        for one in still_held(trials):
            x = one.after_s * (1 + 0.03 * number)  # beside each other, or the bars of one row hide those of another
            axes.plot([x, x], one.interval, color=axes.lines[-1].get_color(), alpha=0.5)
    axes.set_xscale("log")
    axes.set_xlim(1.0, 1.2 * LONG_S)
    axes.set_xticks([1, *MOMENTS_S], [f"{value:g}" for value in (1, *MOMENTS_S)])
    axes.minorticks_off()
    axes.set_ylim(-0.02, 1.02)
    axes.set_xlabel("time since the cube was put in, s")
    axes.set_ylabel("share that still holds the cube")
    axes.set_title("Through every byte; bars: 95 % intervals", fontsize="medium")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, loc="lower left")
    with whole(path) as draft:
        figure.savefig(draft, dpi=120)
