"""The built hand with one object: a person holds it in place while the hand closes, then lets go."""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.side import Side
from model.built import build_built
from model.parameters import BuiltHandParameters
from model.plant import BuiltHandPlant

from .skin import Skin, with_skin

Shape = Literal["sphere", "cylinder", "box"]

FRICTION = 0.4
"""Sliding friction of an object and printed plastic (assumed; 0.3 to 0.5 are usual); a skin has its own."""
NORMAL_TO_FRICTION = 10.0
"""How much stiffer a contact is along the surface than across: with 1, what is held creeps out of the hand."""
TWIST_FRICTION_M = 0.003
"""Friction against twisting at one point, as the radius of a soft pad's contact patch, m (assumed)."""
PERSON_DAMPING = 50.0
"""How a person's hand gives way to the robot's, N s/m: 5 N move it by 10 mm in 0.1 s (assumed)."""
PERSON_TWIST_DAMPING = 0.08
"""The same for turning, N m s/rad: fingers that hold 4 cm from the middle."""
TYPES = {
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "box": mujoco.mjtGeom.mjGEOM_BOX,
}
RGBA = (0.90, 0.55, 0.15, 1.0)


@dataclass(frozen=True)
class HeldObject:
    """A solid of even density.

    Raises:
        ValueError: a size, mass or friction that is not positive.
    """

    shape: Shape
    size_mm: tuple[float, ...]
    """Diameter of a sphere; diameter and length of a cylinder (a disc is a short one); edges of a box or plate."""
    mass_kg: float
    friction: float = FRICTION
    """Against a part of the hand without a skin; the larger of object and hand counts, and the hand's is 0.2."""

    def __post_init__(self) -> None:
        wanted = {"sphere": 1, "cylinder": 2, "box": 3}[self.shape]
        if len(self.size_mm) != wanted or min(*self.size_mm, self.mass_kg, self.friction) <= 0.0:
            raise ValueError(f"a {self.shape} has {wanted} positive sizes, and mass and friction are positive: {self}")

    @property
    def half_length_m(self) -> float:
        """Half of its length along its axis, m: a cylinder's axis, the last edge of a box; zero for a sphere."""
        return 0.0 if self.shape == "sphere" else 0.0005 * self.size_mm[-1]

    def half_sizes(self) -> NDArray[np.float64]:
        """Return what MuJoCo calls the size of such a geom, (3,), m."""
        half = np.zeros(3)
        half[: len(self.size_mm)] = 0.0005 * np.array(self.size_mm)
        return half


class ObjectPlant(BuiltHandPlant):
    """A built hand and an object that nothing can touch until `appear`, and that falls freely after `let_go`."""

    def __init__(
        self,
        thing: HeldObject,
        position: ArrayLike,
        orientation: ArrayLike,
        parameters: BuiltHandParameters | None = None,
        skin: Skin = Skin.PLASTIC,
    ) -> None:
        """Put `thing` at `position` (3,), m, and `orientation` (4,), unit quaternion w x y z, in the world frame."""
        self._thing, self._position, self._orientation = thing, np.asarray(position), np.asarray(orientation)
        # A unit may leave contacts out, which a hand that is fitted without an object does not need.
        super().__init__(with_skin(replace(parameters or BuiltHandParameters(), contacts=True), skin))
        self._body = self._model.body("object").id
        self._geom = self._model.geom("object").id
        joint = self._model.joint("object")
        self._qpos, self._dofs = joint.qposadr[0], slice(joint.dofadr[0], joint.dofadr[0] + 6)
        self._touchable = int(self._model.geom_contype[self._geom])
        self._hold()

    def _hold(self) -> None:
        """Let a person hold the object, where nothing can touch it."""
        self._model.body_gravcomp[self._body] = 1.0
        self._model.dof_damping[self._dofs] = 3 * [PERSON_DAMPING] + 3 * [PERSON_TWIST_DAMPING]
        self._model.geom_contype[self._geom] = self._model.geom_conaffinity[self._geom] = 0

    def appear(self) -> None:
        """Let the hand touch the object from now on."""
        self._model.geom_contype[self._geom] = self._model.geom_conaffinity[self._geom] = self._touchable

    def let_go(self) -> None:
        """Let the person take the hand away: only the robot's hand holds the object from now on."""
        self._model.body_gravcomp[self._body] = 0.0
        self._model.dof_damping[self._dofs] = 0.0

    def pull(self, acceleration: ArrayLike) -> None:
        """Let gravity act along `acceleration` (3,), m/s², world frame, in which the hand stands still."""
        self._model.opt.gravity[:] = acceleration

    def push(self, force: ArrayLike) -> None:
        """Push at the object's centre with `force` (3,), N, world frame, until the next call."""
        self._data.xfrc_applied[self._body, :3] = force

    def pose(self) -> NDArray[np.float64]:
        """Return the object's position, m, and orientation, w x y z: (7,), world frame."""
        return np.concatenate([self._data.xpos[self._body], self._data.xquat[self._body]])

    def ends(self) -> NDArray[np.float64]:
        """Return the two ends of the object's axis, (2, 3), m, world frame; of a sphere its centre twice."""
        along = self._data.xmat[self._body].reshape(3, 3)[:, 2] * self._thing.half_length_m
        ends: NDArray[np.float64] = self._data.xpos[self._body] + np.outer((1.0, -1.0), along)
        return ends

    def touching(self) -> frozenset[str]:
        """Return the names of the hand's links that touch the object."""
        pairs = self._data.contact.geom
        met = self._model.geom_bodyid[pairs[(pairs == self._geom).any(axis=1)]]
        return frozenset(self._model.body(body).name for body in met.ravel()) - {"object"}

    def _spec(self, hand: Side) -> mujoco.MjSpec:
        spec = _bare_hand(hand, self.parameters).copy()
        # Dry friction holds, and is the same in all directions along a surface.
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        spec.option.impratio = NORMAL_TO_FRICTION
        add_object(spec, self._thing, self._position, self._orientation)
        return spec


@lru_cache(maxsize=16)
def _bare_hand(hand: Side, parameters: BuiltHandParameters) -> mujoco.MjSpec:
    """Return the hand without an object, made once for each hand and its parameters."""
    return build_built(hand, parameters)


def add_object(spec: mujoco.MjSpec, thing: HeldObject, position: ArrayLike, orientation: ArrayLike) -> None:
    """Add the free object (`object`, free joint `object`) to a hand."""
    body = spec.worldbody.add_body(name="object", pos=np.asarray(position), quat=np.asarray(orientation))
    body.gravcomp = 1.0  # or MuJoCo leaves out what `let_go` changes
    body.add_freejoint(name="object")
    body.add_geom(
        name="object",
        type=TYPES[thing.shape],
        size=thing.half_sizes(),
        mass=thing.mass_kg,
        condim=4,
        friction=(thing.friction, TWIST_FRICTION_M, 0.0001),
        rgba=RGBA,
    )
