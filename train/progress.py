"""Progress of a run: its epochs, and the curve of its checkpoints."""

from __future__ import annotations

import csv
from dataclasses import asdict, dataclass
from math import nan
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from aero.whole_file import whole

CURVE = "curve.csv"
PICTURE = "curve.png"
CONFIDENCE_Z = 1.96
"""Two-sided 95 %."""


@dataclass(frozen=True)
class Checkpoint:
    """One point of the learning curve: the deterministic policy over a set of random starts."""

    attempt: int
    """Which attempt, 0 for the first; a stuck run is begun again."""
    steps: int
    """Environment steps of this attempt."""
    elapsed_s: float
    """Wall time since the first attempt began, s."""
    steps_per_s: float
    """Environment steps a second since the last checkpoint, evaluation excluded."""
    rotation_rad: float
    """Median rotation in an episode, rad."""
    rate_rad_s: float
    """Mean angular velocity, rad/s."""
    survival: float
    """Share of episodes that kept the cube."""
    airborne: float
    """Share of steps without contact."""
    overspeed: float
    """Share of commands that the servo cannot follow."""
    score: float
    """What the best checkpoint is chosen by."""
    average_rate_rad_s: float = nan
    """Mean angular velocity with the moving average of the weights, rad/s."""
    average_survival: float = nan
    """Share of episodes that kept the cube with it."""
    training_rate_rad_s: float = nan
    """Running mean of the hands in training, exploration included, rad/s."""
    hazard_per_s: float = nan
    """Running mean of their drops a second."""
    drop_price: float = nan
    """Price of a drop."""
    rate_error_rad_s: float = nan
    """Standard error of the rate: a checkpoint is measured on few hands."""


@dataclass(frozen=True)
class Epoch:
    """What the hands in training did lately, exploration included; costs nothing to know."""

    attempt: int
    """Which attempt."""
    stage: str
    """Name of the stage."""
    steps: int
    """Environment steps of this attempt."""
    rate_rad_s: float
    """Mean angular velocity."""
    hazard_per_s: float
    """Drops a second of one hand."""
    drop_price: float | None
    """Price of a drop where it follows the drops."""
    steps_per_s: float
    """Environment steps a second, measuring included."""
    left_s: float | None
    """Wall time to the recipe's end at the mean speed of this call, s; None until that is known."""


def append(folder: Path, point: Checkpoint) -> None:
    """Add one point to the curve and redraw the picture."""
    path = folder / CURVE
    new = not path.exists()
    with path.open("a", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(asdict(point)))
        if new:
            writer.writeheader()
        writer.writerow(asdict(point))
    picture(read(folder), folder / PICTURE)


def read(folder: Path) -> list[Checkpoint]:
    """Return the curve of a run."""
    kinds: dict[str, Any] = {"attempt": int, "steps": int}
    with (folder / CURVE).open(newline="") as file:
        rows = [{name: kinds.get(name, float)(value) for name, value in row.items()} for row in csv.DictReader(file)]
    return [Checkpoint(**row) for row in rows]


def picture(points: list[Checkpoint], path: Path) -> None:
    """Draw rate, with its interval of 95 %, and survival against environment steps, one line an attempt."""
    figure = Figure(figsize=(7, 5), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True)
    for attempt in sorted({point.attempt for point in points}):
        own = [point for point in points if point.attempt == attempt]
        steps = [point.steps / 1e6 for point in own]
        errors = [CONFIDENCE_Z * point.rate_error_rad_s for point in own]
        top.errorbar(steps, [point.rate_rad_s for point in own], errors, fmt="o-", ms=3, label=f"attempt {attempt}")
        bottom.plot(steps, [point.survival for point in own], marker="o", markersize=3)
    top.set_ylabel("rate, rad/s; bars: 95 %")
    top.legend(frameon=False)
    bottom.set_ylabel("share that keeps the cube")
    bottom.set_xlabel("environment steps, millions")
    bottom.set_ylim(-0.02, 1.02)
    with whole(path) as draft:
        figure.savefig(draft, dpi=110)
