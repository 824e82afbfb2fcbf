"""Built hand with the cube of the rotation task, for running a policy through the whole chain."""

from dataclasses import replace
from math import nan

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.side import Side
from model.parameters import BuiltHandParameters
from model.plant import BuiltHandPlant
from simulator.scene import (
    CUBE,
    CUBE_START,
    LOST_HEIGHT_M,
    LOST_UNTOUCHED_S,
    SETTLING_S,
    WEDGED_RAD_S,
    WEDGED_S,
    WEDGED_Y_M,
    Cube,
    add_cube,
)

OUT_OF_REACH = (1.0, 0.0, 0.0)
"""Position of the cube until it is placed, m; it falls freely there."""
GAP_M = 0.0005
"""Threshold of the gap between cube and hand, m; above it the cube counts as let go. A cube on moving fingers has no
contact at 1 to 3 % of instants, with an invisible median gap of 0.1 mm."""
PLACING_SPREAD_M = 0.002
"""Standard deviation of the cube's manual placement along each axis, m."""


class CubePlant(BuiltHandPlant):
    """Built hand with a cube, out of reach until `place_cube`."""

    def __init__(
        self,
        parameters: BuiltHandParameters | None = None,
        side: Side = "right",
        cube: Cube = CUBE,
        *,
        seed: int = 0,
    ) -> None:
        self._cube = cube
        # Force contacts on, because a unit fitted without an object may have them off.
        super().__init__(replace(parameters or BuiltHandParameters(), contacts=True), side, seed=seed)
        joint = self._model.joint("cube")
        self._cube_qpos, self._cube_dof = joint.qposadr[0], joint.dofadr[0]
        self._turned = 0.0
        self.place_cube(OUT_OF_REACH)

    def place_cube(self, position: ArrayLike, orientation: ArrayLike = (1.0, 0.0, 0.0, 0.0)) -> None:
        """Place the cube at rest at `position` (3,), m, `orientation` (4,), unit quaternion w x y z; world frame."""
        self._data.qpos[self._cube_qpos : self._cube_qpos + 3] = position
        self._data.qpos[self._cube_qpos + 3 : self._cube_qpos + 7] = orientation
        self._data.qvel[self._cube_dof : self._cube_dof + 6] = 0.0
        self._turned = 0.0

    def become(self, parameters: BuiltHandParameters) -> None:
        """Replace the hand's parameters and keep the state of hand and cube."""
        super().become(replace(parameters, contacts=True))

    def advance_to(self, t: float) -> None:
        """Integrate to exactly `t` (s) and accumulate the cube's rotation."""
        before, spin = self.time, self._spin()
        super().advance_to(t)
        if t > before:
            self._turned += 0.5 * (spin + self._spin()) * (t - before)

    @property
    def cube_rotation(self) -> float:
        """Rotation of the cube about the vertical since its placement, rad, unwrapped."""
        return self._turned

    def cube_position(self) -> NDArray[np.float64]:
        """Return the centre of the cube, (3,), m, world frame."""
        position: NDArray[np.float64] = self._data.qpos[self._cube_qpos : self._cube_qpos + 3].copy()
        return position

    def cube_touched(self) -> bool:
        """Return whether anything touches the cube."""
        return bool((self._data.contact.geom == self._model.geom("cube").id).any())

    def cube_clear(self, by_m: float) -> bool:
        """Return whether every part of the hand is at least `by_m` from the cube's surface, m."""
        model, cube = self._model, self._model.geom("cube").id
        solid = np.flatnonzero((model.geom_contype | model.geom_conaffinity) != 0)
        return not any(
            mujoco.mj_geomDistance(model, self._data, cube, geom, by_m, None) < by_m for geom in solid if geom != cube
        )

    def posture(self) -> NDArray[np.float64]:
        """Return joint angles, rad, and the cube's position, m, and orientation, w x y z: (23,)."""
        cube = self._data.qpos[self._cube_qpos : self._cube_qpos + 7]
        return np.concatenate([self._data.qpos[self.compiled.joint_qpos], cube])

    def _spec(self, side: Side) -> mujoco.MjSpec:
        spec = super()._spec(side)
        add_cube(spec, self._cube)
        return spec

    def _spin(self) -> float:
        """Return the cube's angular velocity about the vertical, rad/s."""
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, self._data.qpos[self._cube_qpos + 3 : self._cube_qpos + 7])
        return float(rotation[6:] @ self._data.qvel[self._cube_dof + 3 : self._cube_dof + 6])


class CubeWatch:
    """Placement and tracking of a cube until it is lost."""

    def __init__(self, plant: CubePlant, seed: int) -> None:
        """Track the cube of `plant`; its placement is drawn from `seed`."""
        self._plant = plant
        spread = PLACING_SPREAD_M * np.random.default_rng(seed).standard_normal(3)
        self._position = np.array(CUBE_START) + spread
        self._began = 0.0
        self.alive_s = 0.0
        """Time from the placement to the last sample or the loss, s."""
        self.rotation_rad = 0.0
        """Rotation about the vertical during `alive_s`, rad."""
        self.lost = False
        self._touched_at = 0.0
        self._turned: list[tuple[float, float]] = []
        """Time since the placement, s, and rotation, rad, at each sample."""
        self._samples = self._untouched = self._let_go = 0
        self.postures: list[NDArray[np.float64]] = []
        """Posture of hand and cube at the end of each control period, for `simulator.pictures.frames`."""

    def place(self) -> None:
        """Place the cube at rest in the hand and start its time."""
        self._plant.place_cube(self._position)
        self._began = self._touched_at = self._plant.time

    def sample(self) -> None:
        """Record posture and cube after a control period."""
        self.postures.append(self._plant.posture())
        if not self.lost:
            self.alive_s = self._plant.time - self._began
            self.rotation_rad = self._plant.cube_rotation
            self._turned.append((self.alive_s, self.rotation_rad))
            touched = self._plant.cube_touched()
            if touched:
                self._touched_at = self._plant.time
            untouched_s = self._plant.time - self._touched_at
            self.lost = bool(self._plant.cube_position()[2] < LOST_HEIGHT_M) or untouched_s > LOST_UNTOUCHED_S
            if self.alive_s > SETTLING_S:
                self._samples += 1
                if not touched:
                    self._untouched += 1
                    self._let_go += self._plant.cube_clear(GAP_M)

    @property
    def wedged(self) -> bool:
        """Whether a kept cube is stuck: beside the fingers, or not turned over the last seconds, by `WEDGED_...`."""
        if self.lost:
            return False
        before = [turned for at, turned in self._turned if at <= self.alive_s - WEDGED_S]
        still = bool(before) and abs(self.rotation_rad - before[-1]) < WEDGED_RAD_S * WEDGED_S
        return still or bool(abs(self._plant.cube_position()[1]) > WEDGED_Y_M)

    @property
    def airborne(self) -> float:
        """Fraction of samples without contact to the cube, after its settling; NaN before."""
        return self._untouched / self._samples if self._samples else nan

    @property
    def let_go(self) -> float:
        """Fraction of samples with a gap of at least `GAP_M` around the cube, after its settling; NaN before."""
        return self._let_go / self._samples if self._samples else nan

    @property
    def rate_rad_s(self) -> float:
        """Mean angular velocity, rad/s; zero before the first control period."""
        return self.rotation_rad / self.alive_s if self.alive_s else 0.0
