"""What a training run leaves in its folder: checkpoints, the best policy, the curve, and where it stands."""

from __future__ import annotations

import csv
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

CURVE = "curve.csv"
PICTURE = "curve.png"
STATE = "state.json"
PARAMETERS = "parameters.npz"


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
    """Share of steps without contact, on the routed hands."""
    overspeed: float
    """Share of commands that the servo cannot follow."""
    score: float
    """What the best checkpoint is chosen by."""


@dataclass(frozen=True)
class Standing:
    """Where a run stands, so that it can go on."""

    recipe: str
    """Name of the recipe."""
    seed: int
    """The run's seed."""
    attempt: int = 0
    """The attempt that is running."""
    stage: int = 0
    """The stage of the recipe that is running."""
    steps: int = 0
    """Environment steps of that attempt."""
    elapsed_s: float = 0.0
    """Wall time of all attempts, s."""
    processor_s: float = 0.0
    """Processor time of all attempts, threads added up, s."""
    resumes: int = 0
    """How often the run went on after it had ended or was broken off."""
    best_score: float | None = None
    """Score of the stage's best checkpoint, of all attempts."""


def append(folder: Path, point: Checkpoint) -> None:
    """Add one point to the curve and draw the picture anew."""
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


def write_standing(folder: Path, standing: Standing) -> None:
    """Write where the run stands; an interrupted write leaves the old file."""
    partial = folder / f"{STATE}.partial"
    partial.write_text(json.dumps(asdict(standing), indent=1))
    partial.replace(folder / STATE)


def read_standing(folder: Path) -> Standing:
    """Read where a run stands.

    Raises:
        FileNotFoundError: there is no run in `folder`.
    """
    return Standing(**json.loads((folder / STATE).read_text()))


def picture(points: list[Checkpoint], path: Path) -> None:
    """Draw rotation and survival against environment steps, one line an attempt."""
    figure = Figure(figsize=(7, 5), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True)
    for attempt in sorted({point.attempt for point in points}):
        own = [point for point in points if point.attempt == attempt]
        steps = [point.steps / 1e6 for point in own]
        top.plot(steps, [point.rotation_rad for point in own], marker="o", markersize=3, label=f"attempt {attempt}")
        bottom.plot(steps, [point.survival for point in own], marker="o", markersize=3)
    top.set_ylabel("median rotation in 15 s, rad")
    top.legend(frameon=False)
    bottom.set_ylabel("share that keeps the cube")
    bottom.set_xlabel("environment steps, millions")
    bottom.set_ylim(-0.02, 1.02)
    figure.savefig(path, dpi=110)
