"""How a policy is run on a hand: a row of `deployments.toml`."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files

from aero.policy.file import Policy
from aero.policy.running import RunSettings
from aero.policy.settings import PRESETS
from aero.policy.task import ShownAction
from model.scene import CUBE, Cube
from model.units.cable_correction import correction, named_correction
from model.units.plausible import PLAUSIBLE, unit_named
from train.evaluation.cube_trial import Surroundings
from train.evaluation.trials import EXACT, Case

OWN = "own"
"""Stands for what the policy was trained with."""
ANY_HAND = PLAUSIBLE.removesuffix(":")
"""Stands for another hand of the healthy population in each trial."""


@dataclass(frozen=True)
class Deployment:
    """A way to run any policy."""

    name: str
    meaning: str
    """For people."""
    unit: str
    """As `unit_named` takes it, or `ANY_HAND`."""
    firmware: str
    settings: str
    """A preset of `aero.policy.settings`, or `OWN`."""
    one_period_late: bool
    """Whether each command is written a period late."""
    shown_action: str
    """A value of `ShownAction`, or `OWN`."""
    correction: str
    """Correction of the cables: `typical`, `none`, or `EXACT` for the hand's own."""
    guarded: bool
    """Whether our guard watches the hand."""
    reference: str = ""
    """What a physical hand did in it, with the policy's name."""
    measured_rad_s: float | None = None
    """How fast a physical hand turned the cube in it, with that policy."""

    def run_settings(self, seconds: float) -> RunSettings:
        """Return how the loop runs, but for the correction."""
        return RunSettings(
            seconds=seconds,
            settings=None if self.settings == OWN else PRESETS[self.settings],
            one_period_late=self.one_period_late,
            shown_action=None if self.shown_action == OWN else ShownAction(self.shown_action),
        )

    def cases(self, policy: Policy, trials: int, *, seconds: float, seed: int, cube: Cube = CUBE) -> list[Case]:
        """Return the trials with `cube` through the bytes, with seeds from `seed` on.

        Raises:
            ValueError: there is no such unit.
        """
        found = []
        for k in range(trials):
            unit = unit_named(f"{PLAUSIBLE}{seed + k}" if self.unit == ANY_HAND else self.unit)
            settings = self.run_settings(seconds)
            grasp = settings.settings or policy.settings
            exact = self.correction == EXACT
            row = correction(unit, grasp) if exact else named_correction(self.correction, grasp)
            settings = replace(settings, correction=tuple(row.tolist()))
            surroundings = Surroundings(cube, guarded=self.guarded)
            found.append(Case(self.name, unit, self.firmware, seed + k, settings, surroundings))
        return found


@cache
def load_deployments() -> dict[str, Deployment]:
    """Return what `deployments.toml` holds, by name."""
    table = tomllib.loads((files("train") / "evaluation" / "deployments.toml").read_text(encoding="utf-8"))
    return {name: Deployment(name=name, **row) for name, row in table.items()}
