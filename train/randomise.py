"""Domain randomisation as data, drawn in NumPy for both backends: the paper's table "dr" and rows for servos.

Link masses, zero offsets and most others are independent for every element; the five fingertips share one friction and
the cube's three moments one factor, as in the released routine. Cube friction and cube mass are not in the table: the
released routine draws and then overwrites both, so the paper's policies never saw them vary. Cubes with other friction,
mass, size or centre of mass are compiled by `simulator.scene`.
"""

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import mujoco
import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel, Joint
from train.simulator import tip_geoms

Rule = Literal["set", "shift", "scale"]
Index = tuple[Any, ...]
Draws = dict[str, NDArray[np.float64]]
"""Model field to its values in all environments, (environments, *shape of the field)."""


@dataclass(frozen=True)
class RandomRow:
    """One row of the randomisation table, for one model."""

    name: str
    rule: Rule
    """Effect of a draw on the nominal value."""
    low: float
    """Lower end of the uniform distribution."""
    high: float
    """Upper end of the uniform distribution."""
    where: tuple[tuple[str, Index], ...]
    """Model fields and their randomised elements; several fields share one draw."""
    shared: bool = False
    """Whether all elements share one draw."""


_MOTORS = np.arange(len(Channel))
_GAINS: tuple[tuple[str, Index], ...] = (("actuator_gainprm", (_MOTORS, 0)), ("actuator_biasprm", (_MOTORS, 1)))
_FORCES: tuple[tuple[str, Index], ...] = (("actuator_forcerange", (_MOTORS, 0)), ("actuator_forcerange", (_MOTORS, 1)))
SERVO_ROWS = (
    RandomRow("servo stiffness", "scale", 2.0, 4.0, _GAINS, shared=True),
    RandomRow("force behind the sheaths", "scale", 0.65, 1.0, _FORCES),
)
"""Additional rows for a routed hand behind servos.

A servo's 0.0051 N m a count are 41 kN/m of cable, against 10 kN/m in the model. Friction in the sheaths of the
recorded hand takes a force down to 1/1.54 of the servo's (unit `reference`).
"""


TIP_FRICTION = (0.5, 1.0)
"""Friction range of the paper, which excludes the model's own 0.2."""


def table(model: mujoco.MjModel) -> tuple[RandomRow, ...]:
    """Return the paper's table for the elements of `model`, a compiled `train.simulator`."""
    cube = model.body("cube").id
    joints = np.arange(len(Joint))
    links = np.array([body for body in range(model.nbody) if _is_link(model, body)])
    return (
        RandomRow("fingertip friction", "set", *TIP_FRICTION, (("geom_friction", (tip_geoms(model), 0)),), shared=True),
        RandomRow("cube inertia", "scale", 0.8, 1.2, (("body_inertia", (cube,)),), shared=True),
        RandomRow("cube centre of mass", "shift", -0.005, 0.005, (("body_ipos", (cube,)),)),
        RandomRow("joint zero offsets", "shift", -0.05, 0.05, (("qpos0", (joints,)),)),
        RandomRow("joint dry friction", "scale", 0.5, 2.0, (("dof_frictionloss", (joints,)),)),
        RandomRow("joint armature", "scale", 1.0, 1.05, (("dof_armature", (joints,)),)),
        RandomRow("link masses", "scale", 0.9, 1.1, (("body_mass", (links,)),)),
        RandomRow("actuator position gain", "scale", 0.8, 1.2, _GAINS),
        RandomRow("joint damping", "scale", 0.8, 1.2, (("dof_damping", (joints,)),)),
    )


CUBE_FIELDS = (
    "geom_size", "geom_rbound", "geom_aabb", "geom_friction",
    "body_mass", "body_subtreemass", "body_inertia", "body_ipos", "body_invweight0", "dof_invweight0", "dof_M0",
)  # fmt: skip
"""Model fields that depend on the cube, on both backends."""


def cube_draws(scenes: Sequence[mujoco.MjModel]) -> Draws:
    """Return the cube-dependent fields of compiled scenes, one scene per environment."""
    return {field: np.stack([getattr(scene, field) for scene in scenes]) for field in CUBE_FIELDS}


def draw(
    model: mujoco.MjModel,
    rng: np.random.Generator,
    environments: int,
    rows: tuple[RandomRow, ...],
    cubes: Draws | None = None,
) -> Draws:
    """Draw the fields of `rows` for every environment, starting from the environment's fields in `cubes`, if any."""
    fields: Draws = dict(cubes or {})
    for row in rows:
        nominal = getattr(model, row.where[0][0])[row.where[0][1]]
        shape = (1,) * nominal.ndim if row.shared else nominal.shape
        drawn = rng.uniform(row.low, row.high, (environments, *shape))
        for field, index in row.where:
            values = fields.setdefault(field, np.repeat(getattr(model, field)[None], environments, axis=0))
            old = values[:, *index]
            values[:, *index] = {"set": drawn + 0 * old, "shift": old + drawn, "scale": old * drawn}[row.rule]
    return fields


def models(model: mujoco.MjModel, draws: Draws) -> list[mujoco.MjModel]:
    """Return one copy of `model` for each environment of `draws`.

    A body whose inertia or centre of mass is drawn must be compiled with `simple=0`: MuJoCo ignores both otherwise.
    """
    inertial = _with_another_inertial(model, draws)
    environments = len(next(iter(draws.values())))
    copies = [copy.copy(model) for _ in range(environments)]
    for environment, one in enumerate(copies):
        for field, values in draws.items():
            getattr(one, field)[:] = values[environment]
        one.body_sameframe[inertial] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE  # otherwise MuJoCo ignores `body_ipos`
        for body in inertial:
            _bound(one, body)
    return copies


def _with_another_inertial(model: mujoco.MjModel, draws: Draws) -> NDArray[np.int_]:
    """Return the bodies whose inertia or centre of mass differs from the model's in some environment."""
    drawn = np.zeros(model.nbody, bool)
    for field in draws.keys() & {"body_inertia", "body_ipos"}:
        drawn |= (draws[field] != getattr(model, field)).any(axis=(0, 2))
    return np.flatnonzero(drawn)


def _bound(model: mujoco.MjModel, body: int) -> None:
    """Move the bounding box of a single-geom body to the geom, for MuJoCo's contact search.

    MuJoCo stores the box relative to the centre of mass; without the move, a drawn centre of mass hides contacts up to
    5 mm deep.
    """
    (geom,) = np.flatnonzero(model.geom_bodyid == body)
    centre, half = np.split(model.geom_aabb[geom], 2)
    model.bvh_aabb[model.body_bvhadr[body]] = (*(centre - model.body_ipos[body]), *half)


def _is_link(model: mujoco.MjModel, body: int) -> bool:
    """Return whether a body is the palm or a link of a digit (21 in all)."""
    return model.body(body).name not in ("world", "mount", "cube")
