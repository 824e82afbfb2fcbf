"""A policy on an emulated hand with a cube, through every byte: does it keep the cube, and how fast does it turn it?"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aero.actuation import ActuationMap
from aero.policy.file import Policy
from aero.policy.limits import Ending
from aero.policy.loop import run_policy
from aero.policy.running import Run, RunSettings, Step
from aero.safety import Thresholds
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import InProcessLink
from hil.targets.guarding import guard
from model.cube_plant import CubePlant
from model.scene import CUBE_START
from model.units import Unit

LOST_HEIGHT = -0.05
"""Height of the cube's centre below which it is lost, world frame, m; as in training."""
PLACING_SPREAD_M = 0.002
"""Standard deviation of where a person puts the cube, along each axis, m."""


@dataclass(frozen=True)
class Trial:
    """What one trial came to."""

    unit: str
    """The hand."""
    firmware: str
    """What its board ran."""
    seed: int
    """Of the hand's noise and of where the cube was put."""
    kept: bool
    """Whether the cube was still in the hand when the time was over, and nothing ended the run before."""
    alive_s: float
    """Time until then or until the loss, s."""
    rotation_rad: float
    """Rotation about the vertical in that time, rad."""
    run: Run
    """What the loop saw: its ending, missing readings, saturation, currents."""
    travel_per_s: tuple[float, ...]
    """Commanded travel of each channel while the cube was held, (7,), m/s, abduction rad/s."""
    mean_currents_a: tuple[float, ...]
    """Mean of each channel's absolute motor current while the policy acted, (7,), A."""

    @property
    def rate_rad_s(self) -> float:
        """Mean angular velocity, rad/s."""
        return self.rotation_rad / self.alive_s if self.alive_s else 0.0


class _Cube:
    """Watches the cube while the policy runs."""

    def __init__(self, plant: CubePlant, position: np.ndarray, on_step: Callable[[Step], None]) -> None:
        self._plant, self._position, self._on_step = plant, position, on_step
        self._began = 0.0
        self.alive_s, self.rotation, self.lost = 0.0, 0.0, False
        self.targets: list[np.ndarray] = []
        self.currents: list[np.ndarray] = []

    def place(self) -> None:
        self._plant.place_cube(self._position)
        self._began = self._plant.time

    def watch(self, step: Step) -> None:
        self.currents.append(np.abs(step.currents_a))
        if not self.lost:
            self.targets.append(step.target)
            self.alive_s = self._plant.time - self._began
            self.rotation = self._plant.cube_rotation
            self.lost = bool(self._plant.cube_position()[2] < LOST_HEIGHT)
        self._on_step(step)


def run_trial(
    policy: Policy,
    unit: Unit,
    *,
    firmware: str = "0.2.0",
    seed: int = 0,
    settings: RunSettings | None = None,
    thresholds: Thresholds | None = None,
    script: NDArray[np.float64] | None = None,
    on_step: Callable[[Step], None] = lambda _: None,
) -> Trial:
    """Run `policy` once from the nominal grasp with the cube put into the hand.

    Args:
        policy: what acts.
        unit: mechanics and servos of the emulated hand.
        firmware: version the board runs.
        seed: of the hand's noise and of where the cube is put.
        settings: of the loop; the policy's own and 15 s when left out.
        thresholds: of the guard, which watches this hand as it does a physical one; the defaults when left out.
        script: actions (periods, 7) to play open loop in place of the policy's.
        on_step: told about every control period.
    """
    settings = settings or RunSettings()
    plant = CubePlant(unit.hand)
    electronics = EmulatedHand(plant, firmware=firmware, servos=unit.servos, seed=seed)
    position = np.array(CUBE_START) + PLACING_SPREAD_M * np.random.default_rng(seed).standard_normal(3)
    cube = _Cube(plant, position, on_step)
    codec, link = ActuationMap.for_firmware(firmware), InProcessLink(electronics)
    with guard(link, electronics.clock, codec, firmware, thresholds or Thresholds()) as hand:
        hand.begin()
        if policy.settings.torque_limit is not None:
            hand.limit_torques(policy.settings.torque_limit)
        run = run_policy(
            policy,
            hand,
            hand.clock,
            codec,
            settings=settings,
            script=script,
            on_ready=cube.place,
            on_step=cube.watch,
        )
    held_s = len(cube.targets) * (settings.settings or policy.settings).period_s
    travel = np.abs(np.diff(cube.targets, axis=0)).sum(axis=0) / held_s if cube.targets else np.zeros(7)
    return Trial(
        unit=unit.name,
        firmware=firmware,
        seed=seed,
        kept=not cube.lost and run.ending is Ending.TIME,
        alive_s=cube.alive_s,
        rotation_rad=cube.rotation,
        run=run,
        travel_per_s=tuple(travel.tolist()),
        mean_currents_a=tuple(np.nanmean(cube.currents, axis=0).tolist() if cube.currents else [0.0] * 7),
    )
