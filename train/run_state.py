"""Where a run stands, in one file: what resuming needs to give the weights that an unbroken run gives."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import jax
import numpy as np

from aero.exit_code import Exit
from aero.whole_file import whole

STATE = "state.npz"
_STANDING = "standing"
MEMORY_UPDATES = 20
"""Updates of the networks that the running means look back on."""


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
    processor_s: float = 0.0
    """Processor time of all attempts, threads added up, s."""
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


class RunFolderError(ValueError):
    """A folder does not hold the run that was asked for, or holds one that was not; the message says which."""

    exit_code = Exit.USAGE


def save_state(folder: Path, standing: Standing, arrays: Any) -> None:
    """Write a pytree of arrays and where the run stands; an interrupted write leaves the old file."""
    leaves = {f"{k:03d}": np.asarray(leaf) for k, leaf in enumerate(jax.tree.leaves(arrays))}
    with whole(folder / STATE) as draft, draft.open("xb") as file:
        np.savez(file, allow_pickle=False, **{_STANDING: np.array(json.dumps(asdict(standing)))}, **leaves)


def read_standing(folder: Path) -> Standing:
    """Read where a run stands.

    Raises:
        RunFolderError: there is no run in `folder`, or none that can be read.
    """
    try:
        with np.load(folder / STATE, allow_pickle=False) as archive:
            row = json.loads(str(archive[_STANDING]))
    except FileNotFoundError as error:
        raise RunFolderError(f"{folder} holds no run yet") from error
    except (OSError, ValueError, KeyError, BadZipFile) as error:
        raise RunFolderError(f"{folder / STATE} is damaged ({error}); use another folder") from error
    try:
        return Standing(**row | {"tendency": Tendency(**row["tendency"])})
    except (TypeError, KeyError) as error:
        raise RunFolderError(f"{folder / STATE} is of another version of aero-hil; use another folder") from error


def load_arrays(folder: Path, template: Any) -> Any:
    """Read the arrays of a run into the structure of `template`, a pytree of arrays or shapes.

    Raises:
        ValueError: the file holds other shapes, so it belongs to another recipe.
    """
    leaves, structure = jax.tree.flatten(template)
    with np.load(folder / STATE, allow_pickle=False) as archive:
        stored = [archive[name] for name in sorted(set(archive.files) - {_STANDING})]
    if [leaf.shape for leaf in leaves] != [array.shape for array in stored]:
        raise RunFolderError(f"{folder / STATE} does not fit the recipe's networks; it belongs to another recipe")
    return jax.tree.unflatten(structure, [jax.numpy.asarray(array) for array in stored])
