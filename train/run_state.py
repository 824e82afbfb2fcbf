"""What a run leaves in its folder: where it stands, arrays, and the curve of its checkpoints.

Resuming from it gives the weights that an unbroken run gives.
"""

from __future__ import annotations

import csv
import json
from dataclasses import asdict, dataclass, field, replace
from math import nan
from pathlib import Path
from typing import Any

import jax
import numpy as np
from matplotlib.figure import Figure

from aero.exit_code import Exit
from aero.regular_file import read_npz, read_text
from aero.whole_file import whole

STATE, CURVE, PICTURE = "state.npz", "curve.csv", "curve.png"
CHECKPOINTS = "checkpoints"
"""Folder of every checkpoint's parameters."""
AVERAGE = "average_"
"""Before the name of a checkpoint's moving average."""
_STANDING = "standing"
MEMORY_UPDATES = 20
"""Updates of the networks that the running means look back on."""
CONFIDENCE_Z = 1.96
"""Two-sided 95 %."""


class RunFolderError(ValueError):
    """A folder does not hold the run that was asked for, or holds one that was not; the message says which."""

    exit_code = Exit.USAGE


@dataclass(frozen=True)
class Tendency:
    """Running means of what the hands in training do, exploration included."""

    rate_rad_s: float = 0.0
    """Mean angular velocity of the cubes."""
    hazard_per_s: float = 0.0
    """Drops a second of one hand."""
    updates: int = 0
    """How many updates are in the means."""

    def after(self, rate_rad_s: float, hazard_per_s: float) -> Tendency:
        """Return the means after one more update."""
        share = 1.0 / min(self.updates + 1, MEMORY_UPDATES)
        return Tendency(
            self.rate_rad_s + share * (rate_rad_s - self.rate_rad_s),
            self.hazard_per_s + share * (hazard_per_s - self.hazard_per_s),
            self.updates + 1,
        )


@dataclass(frozen=True)
class Standing:
    """Where a run stands, but for the arrays."""

    recipe: str
    """Name of the recipe."""
    seed: int
    """The run's seed."""
    attempt: int = 0
    """The attempt that is running; a stuck run is begun again."""
    stage: int = 0
    """The stage of the recipe that is running."""
    steps: int = 0
    """Environment steps of that attempt."""
    updates: int = 0
    """Updates of the networks in that stage."""
    new_hands: int = 0
    """Hands that have come in that stage."""
    drop_price: float | None = None
    """Price of a drop where it follows the drops."""
    tendency: Tendency = field(default_factory=Tendency)
    """Running means of the hands in training."""
    elapsed_s: float = 0.0
    """Wall time of all attempts, s."""
    resumes: int = 0
    """How often the run was resumed."""
    best_rate_rad_s: float = 0.0
    """Highest rate of the attempt's checkpoints."""
    best_score: float | None = None
    """Score of the stage's best checkpoint."""
    measured_at: int = 0
    """Updates in the stage at the last checkpoint."""

    def in_stage(self, stage: int, drop_price: float | None) -> Standing:
        """Return the standing at the beginning of a stage."""
        return replace(
            self,
            stage=stage,
            updates=0,
            new_hands=0,
            drop_price=drop_price,
            tendency=Tendency(),
            best_score=None,
            measured_at=0,
        )


LARGEST_BYTES = 2**32
"""Largest size of a file of a run, unpacked, bytes."""


def read_standing(folder: Path) -> Standing:
    """Read where a run stands.

    Raises:
        RunFolderError: there is no run in `folder`, or none that can be read.
    """
    try:
        row = json.loads(str(read_npz(folder / STATE, LARGEST_BYTES)[_STANDING]))
    except FileNotFoundError as error:
        raise RunFolderError(f"{folder} holds no run yet") from error
    except (OSError, ValueError, KeyError) as error:
        raise RunFolderError(f"{folder / STATE} is damaged ({error}); use another folder") from error
    try:
        return Standing(**row | {"tendency": Tendency(**row["tendency"])})
    except (TypeError, KeyError) as error:
        raise RunFolderError(f"{folder / STATE} is of another version of aero-hil; use another folder") from error


def save_arrays(path: Path, tree: Any, standing: Standing | None = None) -> None:
    """Write a pytree of arrays and where the run stands, if given; an interrupted write leaves the old file."""
    arrays = {f"{k:03d}": np.asarray(leaf) for k, leaf in enumerate(jax.tree.leaves(tree))}
    if standing is not None:
        arrays[_STANDING] = np.array(json.dumps(asdict(standing)))
    with whole(path) as draft, draft.open("xb") as file:
        np.savez(file, allow_pickle=False, **arrays)


def load_arrays(path: Path, template: Any) -> Any:
    """Read what `save_arrays` wrote into the structure of `template`, a pytree of arrays or shapes.

    Raises:
        RunFolderError: the file holds other shapes, so it belongs to another recipe.
    """
    leaves, structure = jax.tree.flatten(template)
    arrays = read_npz(path, LARGEST_BYTES)
    stored = [arrays[name] for name in sorted(set(arrays) - {_STANDING})]
    if [leaf.shape for leaf in leaves] != [array.shape for array in stored]:
        raise RunFolderError(f"{path} does not fit the recipe's networks; it belongs to another recipe")
    return jax.tree.unflatten(structure, [jax.numpy.asarray(array) for array in stored])


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
    """Environment steps of this attempt over that time."""
    rotation_rad: float
    """Median rotation in an episode, rad."""
    rate_rad_s: float
    """Mean angular velocity, rad/s."""
    survival: float
    """Share of episodes that kept the cube."""
    airborne: float
    """Share of steps without contact."""
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

    def __str__(self) -> str:
        return (
            f"checkpoint  attempt {self.attempt}  {self.steps / 1e6:6.2f} M steps  {self.elapsed_s / 60:5.1f} min  "
            f"{self.rotation_rad:5.1f} rad  {self.rate_rad_s:5.2f} rad/s  keeps {self.survival:4.0%}; "
            f"average {self.average_rate_rad_s:5.2f} rad/s  keeps {self.average_survival:4.0%}"
        )


def append(folder: Path, point: Checkpoint) -> None:
    """Add one point to the curve and redraw the picture."""
    path = folder / CURVE
    new = not path.exists()
    with path.open("a", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(asdict(point)))
        if new:
            writer.writeheader()
        writer.writerow(asdict(point))
    _draw(read_curve(folder), folder / PICTURE)


def read_curve(folder: Path) -> list[Checkpoint]:
    """Return the curve of a run."""
    kinds: dict[str, Any] = {"attempt": int, "steps": int}
    lines = read_text(folder / CURVE, LARGEST_BYTES).splitlines()
    rows = [{name: kinds.get(name, float)(value) for name, value in row.items()} for row in csv.DictReader(lines)]
    return [Checkpoint(**row) for row in rows]


def _draw(points: list[Checkpoint], path: Path) -> None:
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
