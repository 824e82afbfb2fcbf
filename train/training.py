"""A training run: the stages of a recipe one after another, saved so that no ending loses what was done."""

from __future__ import annotations

import signal
import time
from collections.abc import Mapping
from dataclasses import replace
from enum import Enum
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np

from aero.safety.interrupts import noted
from train.recipe import Recipe
from train.run import CHECKPOINTS, Listener, Order, TrainingRun
from train.run_state import STATE, RunFolderError, Standing, read_standing
from train.stage_run import Backend

# A callback into MuJoCo would wait for the thread that it blocks. Holds only if set before JAX makes its CPU client.
jax.config.update("jax_cpu_enable_async_dispatch", False)

STOPPING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Signals that end a run."""


class StopReason(Enum):
    """Why a run ended."""

    DONE = "the recipe is done"
    TIME = "the time is over"
    STOPPED = "it was stopped"


class _StoppedError(Exception):
    """The run is to end, between two batches of physics."""

    def __init__(self, ending: StopReason) -> None:
        super().__init__(ending.value)
        self.ending = ending


class TrainingEnd(NamedTuple):
    """How a run ended, and what it left."""

    ending: StopReason
    standing: Standing
    by_signal: int | None = None
    """Number of the signal that stopped it."""


def machine_backend() -> Backend:
    """Return `mjx` where JAX finds a GPU, else `native`."""
    return "mjx" if jax.default_backend() == "gpu" else "native"


def accelerated() -> bool:
    """Return whether JAX finds anything faster than the CPU."""
    return bool(jax.default_backend() != "cpu")


def train(
    recipe: Recipe,
    backend: Backend,
    seed: int,
    folder: Path,
    *,
    minutes: float | None = None,
    threads: int | None = None,
    resume: bool = False,
    provenance: Mapping[str, Any] | None = None,
    listener: Listener | None = None,
) -> TrainingEnd:
    """Train until the recipe's steps or the time are over, or a signal comes; nothing that was done is lost.

    The folder gets the curve, the parameters of every checkpoint, the best one of the stage as `<name>.npz`, and the
    state, from which a resumed run reaches the same weights as one that was never interrupted.

    Args:
        recipe: what to train.
        backend: `native` steps MuJoCo on all cores, `mjx` on the accelerator that JAX sees.
        seed: of networks, randomisation, starts and exploration.
        folder: made if missing.
        minutes: wall time of this call; None for no bound.
        threads: of the native backend; None for all cores.
        resume: continue the run in `folder`.
        provenance: what the policy's file is to say besides recipe, seed, attempt, steps and resumes.
        listener: gets checkpoints and epochs.

    Raises:
        FileExistsError: `folder` holds a run and `resume` is not asked for.
        FileNotFoundError: `resume` is asked for and there is no run.
        ValueError: the run in `folder` is of another recipe or seed.
    """
    (folder / CHECKPOINTS).mkdir(parents=True, exist_ok=True)
    standing = _standing(recipe, seed, folder, resume)
    deadline = time.monotonic() + (60.0 * minutes if minutes else np.inf)
    with noted(*STOPPING) as signals:

        def check() -> None:
            if signals:
                raise _StoppedError(StopReason.STOPPED)
            if time.monotonic() >= deadline:
                raise _StoppedError(StopReason.TIME)

        order = Order(recipe, backend, folder, threads, dict(provenance or {}), listener or Listener(), check)
        run = TrainingRun(order, standing)
        ending = StopReason.DONE
        try:
            run.go(resume)
        except _StoppedError as stopped:
            ending = stopped.ending
        finally:  # what was reached is saved, whatever the ending
            run.keep()
    return TrainingEnd(ending, run.standing, signals[0] if signals else None)


def _standing(recipe: Recipe, seed: int, folder: Path, resume: bool) -> Standing:
    if not resume:
        if (folder / STATE).exists():
            raise RunFolderError(f"{folder} holds a run; resume it or choose another folder")
        return Standing(recipe.name, seed)
    standing = read_standing(folder)
    if (standing.recipe, standing.seed) != (recipe.name, seed):
        raise RunFolderError(
            f"{folder} holds recipe {standing.recipe!r} with seed {standing.seed}, not {recipe.name!r} with {seed}"
        )
    return replace(standing, resumes=standing.resumes + 1)
