"""Trial of a policy on an emulated hand with board, bus and cube: survival and rotation rate."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from aero.floats import Floats
from aero.policy.file import Policy
from aero.policy.loop import run_policy
from aero.policy.running import Ending, Run, RunSettings, Step
from hil.emulated.any_hand import open_emulated
from hil.emulated.emulated_spec import EmulatedSpec
from hil.recordings.policy_run import measured_cables
from model.cube_plant import CubePlant, CubeWatch


@dataclass(frozen=True)
class CubeTrial:
    """Result of one trial."""

    spec: EmulatedSpec
    """Hand with its cube; the hand's seed also determines the cube's initial pose."""
    kept: bool
    """Whether the run reached its time limit with the cube in the hand."""
    wedged: bool
    """Whether a kept cube is stuck in the hand (`CubeWatch.wedged`); counted apart from the lost ones."""
    alive_s: float
    """Time until the end of the run or the loss of the cube, s."""
    rotation_rad: float
    """Rotation about the vertical during `alive_s`, rad; positive as a right hand turns the cube, mirrored for a left.
    """
    airborne: float
    """Fraction of control periods that end without contact of the cube; NaN if the cube was lost at once."""
    let_go: float
    """Fraction of control periods that end with nothing within `cube_plant.GAP_M` of the cube."""
    run: Run
    """Record of the control loop: ending, missing readings, saturation, currents."""
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
    spec: EmulatedSpec,
    settings: RunSettings | None = None,
    *,
    measured: bool = False,
    placed: bool = True,
    on_step: Callable[[Step], None] = lambda _: None,
) -> CubeTrial:
    """Run `policy` once from the nominal grasp with the cube placed in the hand.

    Args:
        policy: the policy to run.
        spec: emulated hand with a cube.
        settings: settings of the control loop; None for the policy's own and 15 s.
        measured: True to replace the correction in `settings` by one measured before, as `run-policy` does.
        placed: False to leave the hand empty.
        on_step: called after every control period.
    """
    settings = settings or RunSettings()
    goals: list[Floats] = []
    currents: list[Floats] = []
    with open_emulated(spec) as opened:
        truth = opened.truth
        assert isinstance(truth.plant, CubePlant)
        watch = CubeWatch(truth.plant, spec.seed)

        def follow(step: Step) -> None:
            currents.append(np.abs(step.currents_a))
            if not watch.lost:
                goals.append(step.target)
            watch.sample()
            on_step(step)

        if measured:
            settings = replace(settings, correction=measured_cables(opened).correction)
        if opened.guard is not None:
            opened.guard.expect_stops(())
            if policy.settings.torque_limit is not None:
                opened.guard.limit_torques(policy.settings.torque_limit)
        run = run_policy(
            policy,
            opened.hand,
            truth.electronics.clock,  # the guard polls at each exchange, as for the figures in docs
            opened.map,
            settings=settings,
            on_ready=watch.place if placed else lambda: None,
            on_step=follow,
        )
    held_s = len(goals) * (settings.settings or policy.settings).period_s
    travel = np.abs(np.diff(goals, axis=0)).sum(axis=0) / held_s if goals else np.zeros(7)
    return CubeTrial(
        spec=spec,
        kept=not watch.lost and run.ending is Ending.TIME,
        wedged=watch.wedged,
        alive_s=watch.alive_s,
        rotation_rad=watch.rotation_rad if spec.side == "right" else -watch.rotation_rad,
        airborne=watch.airborne,
        let_go=watch.let_go,
        run=run,
        travel_per_s=tuple(travel.tolist()),
        mean_currents_a=tuple(np.nanmean(currents, axis=0).tolist() if currents else [0.0] * 7),
    )
