"""Any cube on any hand, right and left in turn: the trials that say what an owner has to expect."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from aero.channels import CABLES, Channel
from aero.firmware import DEFAULT_FIRMWARE
from aero.policy.file import Policy
from aero.policy.running import RunSettings
from hil.lab.policies.byte_evaluation import Case
from hil.lab.policies.cube_trial import Surroundings
from hil.lab.policies.disturbance import NONE, Disturbance
from model.cubes import any_cube
from model.geometry import Side
from model.units import Unit, load_unit
from model.units.cable_correction import correction
from model.units.plausible import plausible_unit

ANY_CUBE = "any cube on any hand"
CUBE_STREAM = 2
"""Stream of a trial's seed that its cube is drawn from."""
SIDES: tuple[Side, ...] = ("right", "left")
DISTURBANCES = {
    "not disturbed": NONE,
    "gravity 20 degrees off": Disturbance(tilt_rad=np.radians(20.0)),
    "cube shoved by 0.1 m/s": Disturbance(shove_m_s=0.1),
    "cube shoved by 0.2 m/s": Disturbance(shove_m_s=0.2),
    "hand jolted, 5 m/s² for 0.1 s": Disturbance(jolt_m_s2=5.0),
    "hand jolted, 10 m/s² for 0.1 s": Disturbance(jolt_m_s2=10.0),
}
"""What happens to a hand that someone carries or bumps into: rows of the table of disturbances."""
WRONG_M = 0.0005
"""Standard deviation of a cable's correction that is wrong, m."""
MEASURED = "corrected as measured"
WRONG_STREAM = 3
"""Stream of a trial's seed that the error of its correction is drawn from."""
IS_CABLE = np.isin(np.arange(len(Channel)), CABLES)


def over_any(
    policy: Policy, units: int, *, seconds: float, seed: int, disturbances: Mapping[str, Disturbance] | None = None
) -> list[Case]:
    """Return a trial of any cube on each of `units` random hands, right and left in turn, all corrected for.

    Args:
        policy: what acts.
        units: hands.
        seconds: length of a trial.
        seed: of the first hand; each has the next one, which decides its cube, too.
        disturbances: rows, each over all hands; one without any when left out.
    """
    made = []
    for k in range(units):
        unit = plausible_unit(seed + k)
        settings = RunSettings(seconds=seconds, correction=tuple(correction(unit, policy.settings)))
        cube, side = any_cube(np.random.default_rng((seed + k, CUBE_STREAM))), SIDES[k % len(SIDES)]
        made.append((unit, seed + k, settings, Surroundings(cube, side)))
    return [
        Case(name, unit, DEFAULT_FIRMWARE, own, settings, replace(surroundings, disturbance=disturbance))
        for name, disturbance in (disturbances or {ANY_CUBE: NONE}).items()
        for unit, own, settings, surroundings in made
    ]


def over_disturbances(policy: Policy, units: int, *, seconds: float, seed: int) -> list[Case]:
    """Return the trials of `over_any` under each of `DISTURBANCES`."""
    return over_any(policy, units, seconds=seconds, seed=seed, disturbances=DISTURBANCES)


def over_corrections(policy: Policy, units: int, *, seconds: float, seed: int, twins: Path | None = None) -> list[Case]:
    """Return the trials of `over_any` as the hand is known: exactly, not at all, half a millimetre wrong, as measured.

    Args:
        policy: what acts.
        units: hands.
        seconds: length of a trial.
        seed: of the first hand.
        twins: folder of unit files that were fitted to recordings of these hands (`aero-hil calibrate`), named
            `SEED.toml`; hands without one are not in that row.

    Raises:
        ValueError: `twins` has none of these hands.
    """
    exact = over_any(policy, units, seconds=seconds, seed=seed)
    rows = [replace(case, name="corrected exactly") for case in exact]
    rows += [_corrected(case, "not corrected", np.zeros(7)) for case in exact]
    for case in exact:
        error = WRONG_M * np.random.default_rng((case.seed, WRONG_STREAM)).standard_normal(7) * IS_CABLE
        rows.append(_corrected(case, "corrected, 0.5 mm wrong", np.array(case.settings.correction) + error))
    if twins is not None:
        paths = {case.seed: twins / f"{case.seed}.toml" for case in exact}
        measured = [case for case in exact if paths[case.seed].exists()]
        if not measured:
            raise ValueError(f"{twins} has no {paths[seed].name}, nor the unit file of another hand of this evaluation")
        rows += [_corrected(case, MEASURED, _measured(paths[case.seed], policy)) for case in measured]
    return rows


def _corrected(case: Case, name: str, row: np.ndarray) -> Case:
    return replace(case, name=name, settings=replace(case.settings, correction=tuple(row.tolist())))


def _measured(path: Path, policy: Policy) -> np.ndarray:
    twin: Unit = load_unit(str(path))
    return correction(twin, policy.settings)
