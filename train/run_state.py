"""Files of a run's folder: state, arrays, learning curve.

A run resumed from this folder reaches the weights of an uninterrupted run.
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
AVERAGE = "average_"
"""File name prefix of a checkpoint's moving average."""
_STANDING = "standing"
MEMORY_UPDATES = 20
"""Memory of the running means, updates of the networks."""
CONFIDENCE_Z = 1.96
"""Standard score of a two-sided 95 % interval."""


class RunFolderError(ValueError):
    """The folder holds no run, or another run than the requested one."""

    exit_code = Exit.USAGE


@dataclass(frozen=True)
class Tendency:
    """Running means over the hands in training, exploration included."""

    rate_rad_s: float = 0.0
    """Mean angular velocity of the cubes, rad/s."""
    hazard_per_s: float = 0.0
    """Drop rate of one hand, 1/s."""
    updates: int = 0

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
    """Scalar state of a run; the arrays are stored beside it."""

    recipe: str
    seed: int
    attempt: int = 0
    """Index of the current attempt; a stuck run starts another attempt."""
    stage: int = 0
    steps: int = 0
    updates: int = 0
    new_hands: int = 0
    drop_price: float | None = None
    """Price of a drop if it adapts to the drop rate, else None."""
    tendency: Tendency = field(default_factory=Tendency)
    """Running means over the hands in training."""
    elapsed_s: float = 0.0
    resumes: int = 0
    best_rate_rad_s: float = 0.0
    best_score: float | None = None
    """Score of the stage's best checkpoint."""
    measured_at: int = 0
    """Updates in the stage at the last checkpoint."""

    def in_stage(self, stage: int, drop_price: float | None) -> Standing:
        """Return the state at the beginning of a stage."""
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
"""Size limit of an unpacked file of a run, bytes."""


def read_standing(folder: Path) -> Standing:
    """Read the scalar state of a run.

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
    """Write a pytree of arrays and the scalar state, if given; an interrupted write keeps the old file."""
    arrays = {f"{k:03d}": np.asarray(leaf) for k, leaf in enumerate(jax.tree.leaves(tree))}
    if standing is not None:
        arrays[_STANDING] = np.array(json.dumps(asdict(standing)))
    with whole(path) as draft, draft.open("xb") as file:
        np.savez(file, allow_pickle=False, **arrays)


def load_arrays(path: Path, template: Any) -> Any:
    """Read a file of `save_arrays` into the structure of `template`, a pytree of arrays or shapes.

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
    """Point of the learning curve: the deterministic policy from a set of random starts."""

    attempt: int
    steps: int
    elapsed_s: float
    """Wall time since the start of the first attempt, s."""
    steps_per_s: float
    """Environment steps of this attempt per second of `elapsed_s`."""
    rotation_rad: float
    rate_rad_s: float
    survival: float
    """Fraction of episodes that kept the cube."""
    airborne: float
    """Fraction of steps without contact."""
    score: float
    """Criterion that selects the best checkpoint."""
    average_rate_rad_s: float = nan
    """Mean angular velocity with the moving average of the weights, rad/s."""
    average_survival: float = nan
    """Fraction of episodes that kept the cube with the averaged weights."""
    training_rate_rad_s: float = nan
    """Running mean of the rate in training, exploration included, rad/s."""
    hazard_per_s: float = nan
    """Running mean of the drop rate in training, 1/s."""
    drop_price: float = nan
    rate_error_rad_s: float = nan
    """Standard error of the rate, rad/s; large because each measurement uses few hands."""

    def __str__(self) -> str:
        return (
            f"checkpoint  attempt {self.attempt}  {self.steps / 1e6:6.2f} M steps  {self.elapsed_s / 60:5.1f} min  "
            f"{self.rotation_rad:5.1f} rad  {self.rate_rad_s:5.2f} rad/s  keeps {self.survival:4.0%}; "
            f"average {self.average_rate_rad_s:5.2f} rad/s  keeps {self.average_survival:4.0%}"
        )


def append(folder: Path, point: Checkpoint) -> None:
    """Append one point to the curve and redraw the plot."""
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
    """Draw rate (with 95 % interval) and survival over environment steps, one line per attempt."""
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
