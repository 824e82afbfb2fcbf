"""A policy on an emulated hand with a cube, through every byte: does it keep the cube, and how fast does it turn it?"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aero.actuation import ActuationMap
from aero.driver import AeroHand
from aero.firmware import DEFAULT_FIRMWARE, firmware_of
from aero.policy.file import Policy
from aero.policy.loop import run_policy
from aero.policy.running import Ending, Run, RunSettings, Step
from aero.safety import GuardedHand, Thresholds
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import InProcessLink
from model.cube_plant import CubePlant, CubeWatch
from model.geometry import Side
from model.scene import CUBE, Cube
from model.units import Unit

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Surroundings:
    """What a trial meets besides the hand's mechanics."""

    cube: Cube = CUBE
    """What is turned."""
    side: Side = "right"
    """Which hand; the policy is the same, since lengths and codes are alike on both."""
    guarded: bool = True
    """Whether our guard watches the hand; the official programs have none."""


AS_MEASURED = Surroundings()
"""The paper's cube in a right hand."""


@dataclass(frozen=True)
class CubeTrial:
    """What one trial came to."""

    unit: str
    """The hand."""
    firmware: str
    """What its board ran."""
    seed: int
    """Seed of the hand's noise and of where the cube was put."""
    kept: bool
    """Whether the cube was still in the hand when the time was over, and nothing ended the run before."""
    alive_s: float
    """Time until then or until the loss, s."""
    rotation_rad: float
    """Rotation about the vertical in that time, rad; positive as a right hand turns it, mirrored for a left one."""
    airborne: float
    """Share of the control periods at whose end nothing touched the cube; NaN for a trial that lost it at once."""
    let_go: float
    """Share of those at whose end nothing was within `cube_plant.GAP_M` of the cube."""
    surroundings: Surroundings
    """What it met."""
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


def run_trial(
    policy: Policy,
    unit: Unit,
    *,
    firmware: str = DEFAULT_FIRMWARE,
    seed: int = 0,
    settings: RunSettings | None = None,
    surroundings: Surroundings = AS_MEASURED,
    thresholds: Thresholds | None = None,
    on_step: Callable[[Step], None] = lambda _: None,
) -> CubeTrial:
    """Run `policy` once from the nominal grasp with the cube put into the hand.

    Args:
        policy: what acts.
        unit: mechanics and servos of the emulated hand.
        firmware: version the board runs.
        seed: of the hand's noise and of where the cube is put.
        settings: of the loop; the policy's own and 15 s when left out.
        surroundings: what it meets.
        thresholds: of the guard, which watches this hand as it does a physical one; the defaults when left out.
        on_step: called after every control period.
    """
    settings = settings or RunSettings()
    side = surroundings.side
    plant = CubePlant(unit.hand, side, surroundings.cube)
    electronics = EmulatedHand(plant, hand=side, firmware=firmware, servos=unit.servos, seed=seed)
    watch = CubeWatch(plant, seed)
    targets: list[np.ndarray] = []
    currents: list[np.ndarray] = []

    def follow(step: Step) -> None:
        currents.append(np.abs(step.currents_a))
        if not watch.lost:
            targets.append(step.target)
        watch.sample()
        on_step(step)

    codec = ActuationMap.for_firmware(firmware, hand=side)
    link = InProcessLink(electronics)
    opened = (
        GuardedHand(
            link,
            electronics.clock,
            spans_counts=codec.window.spans_counts(),
            usual=firmware_of(firmware).settings,
            thresholds=thresholds or Thresholds(),
        )
        if surroundings.guarded
        else AeroHand(link, electronics.clock)
    )
    with opened as hand:
        if isinstance(hand, GuardedHand):
            hand.begin()
            if policy.settings.torque_limit is not None:
                hand.limit_torques(policy.settings.torque_limit)
        run = run_policy(
            policy,
            hand,
            electronics.clock,
            codec,
            settings=settings,
            on_ready=watch.place,
            on_step=follow,
        )
    held_s = len(targets) * (settings.settings or policy.settings).period_s
    travel = np.abs(np.diff(targets, axis=0)).sum(axis=0) / held_s if targets else np.zeros(7)
    return CubeTrial(
        unit=unit.name,
        firmware=firmware,
        seed=seed,
        kept=not watch.lost and run.ending is Ending.TIME,
        alive_s=watch.alive_s,
        rotation_rad=watch.rotation_rad if side == "right" else -watch.rotation_rad,
        airborne=watch.airborne,
        let_go=watch.let_go,
        surroundings=surroundings,
        run=run,
        travel_per_s=tuple(travel.tolist()),
        mean_currents_a=tuple(np.nanmean(currents, axis=0).tolist() if currents else [0.0] * 7),
    )
