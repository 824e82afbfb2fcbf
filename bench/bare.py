"""The steps that a run asks of MuJoCo, taken again with nothing around them: what a ratio is measured against."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import mujoco
import numpy as np
import pytest

INPUTS = ("actuator_gainprm", "actuator_biasprm", "actuator_forcerange", "jnt_actfrcrange", "dof_frictionloss")
"""Fields of a model that the emulated hand writes between steps."""


class BareSteps:
    """A log of steps with their inputs, which `run` takes again from the same states."""

    def __init__(self) -> None:
        self._starts: dict[int, tuple[mujoco.MjModel, mujoco.MjData]] = {}
        self._seen: dict[tuple[int, str], Any] = {}
        self._log: list[tuple[int, int, float, list[tuple[str, Any]]]] = []
        self._keep: list[Any] = []

    @contextmanager
    def recording(self) -> Iterator[None]:
        """Log every step that is taken meanwhile."""
        step, second_half = mujoco.mj_step, mujoco.mj_step2

        def logged(original: Callable[..., None]) -> Callable[..., None]:
            def call(model: mujoco.MjModel, data: mujoco.MjData, *steps: int) -> None:
                self._add(model, data, *steps)
                original(model, data, *steps)

            return call

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(mujoco, "mj_step", logged(step))
            # The routed hand takes a step in two halves, of which the first one is the end of the step before.
            patch.setattr(mujoco, "mj_step2", logged(second_half))
            yield

    def run(self) -> None:
        """Take all steps again."""
        hands = {key: (copy.copy(model), copy.copy(data)) for key, (model, data) in self._starts.items()}
        for key, steps, timestep, changes in self._log:
            model, data = hands[key]
            for name, value in changes:
                getattr(data if name == "ctrl" else model, name)[:] = value
            if timestep:
                model.opt.timestep = timestep
            mujoco.mj_step(model, data, steps)

    def _add(self, model: mujoco.MjModel, data: mujoco.MjData, steps: int = 1) -> None:
        key = id(data)
        if key not in self._starts:
            self._starts[key] = copy.copy(model), copy.copy(data)
            self._keep.append(data)
        changes = []
        for name, value in (("ctrl", data.ctrl), *((name, getattr(model, name)) for name in INPUTS)):
            if not np.array_equal(self._seen.get((key, name)), value):
                self._seen[key, name] = value.copy()
                changes.append((name, self._seen[key, name]))
        timestep = model.opt.timestep
        changed = self._seen.get((key, "timestep")) != timestep
        self._seen[key, "timestep"] = timestep
        self._log.append((key, steps, timestep if changed else 0.0, changes))
