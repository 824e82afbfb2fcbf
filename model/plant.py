"""The built hand as the servos see it: seven output shafts in time, and the ground truth behind them.

The inner loop of each servo is an actuator of the physics engine, rewritten when its drive changes, so many physics
steps run in one call and Python acts only where the electronics do. Implements `firmware_emulator.plant.Plant` by
its shape.
"""

from __future__ import annotations

from math import isfinite
from typing import Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from aero.channels import CABLES, Channel, Joint
from model.built import build_built, cable_name, shaft_name, winding
from model.geometry import Side
from model.geometry.winding import SPOOL_RADIUS
from model.parameters import BuiltHandParameters

SHAFTS = len(Channel)
TIME_RESOLUTION = 1e-9
"""Spans shorter than this are not integrated, s; a microsecond is the finest thing on the servo bus."""

UNBOUNDED = 1e6
"""What stands for no bound on a torque, N m."""
# A number, because NumPy compares an array with an enumeration element by element, a hundred times slower.
TENDON_LIMIT = int(mujoco.mjtConstraint.mjCNSTR_LIMIT_TENDON)
"""The kind of constraint that a taut cable is."""


class DriveLike(Protocol):
    """What the plant reads of a servo's drive; see `firmware_emulator.plant.Drive`."""

    @property
    def setpoint(self) -> float:
        """Goal angle, rad."""

    @property
    def stiffness(self) -> float:
        """Position gain, N m/rad."""

    @property
    def damping(self) -> float:
        """Speed gain, N m s/rad."""

    @property
    def torque(self) -> float:
        """Feed-forward, N m."""

    @property
    def limit(self) -> float:
        """Bound on the effort, N m."""

    @property
    def current_limit(self) -> float:
        """Bound on the effort less back-EMF, N m."""

    @property
    def powered(self) -> bool:
        """Whether the winding is driven."""


class BuiltHandPlant:
    """Seven output shafts with spools, cables, joints and return springs behind them.

    Starts at rest in the extended pose, held closed only by cables that are too short for it, unpowered. Deterministic:
    the same calls give the same state to the bit.
    Time is cut where the caller cuts it, by a last shortened step, so a drive changes exactly when it is changed.
    """

    def __init__(self, parameters: BuiltHandParameters | None = None, hand: Side = "right") -> None:
        self.parameters = parameters or BuiltHandParameters()
        spec = self._spec(hand)
        spec.compiler.discardvisual = True  # geoms that nothing touches cost a seventh of a step
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._warnings = self._data.warning.number
        self._model.actuator_forcelimited[:SHAFTS] = 1
        self._model.actuator_biastype[:] = mujoco.mjtBias.mjBIAS_AFFINE
        joints = [self._model.joint(joint.label) for joint in Joint]
        shafts = [self._model.joint(shaft_name(channel)) for channel in Channel]
        self._joint_qpos = np.array([joint.qposadr[0] for joint in joints])
        self._shaft_qpos = np.array([shaft.qposadr[0] for shaft in shafts])
        self._shaft_dofs = np.array([shaft.dofadr[0] for shaft in shafts])
        self._cables = np.array([self._model.tendon(cable_name(channel)).id for channel in CABLES])
        self._cable_dofs = self._shaft_dofs[list(CABLES)]
        self._spool_friction = self._model.dof_frictionloss[self._cable_dofs].copy()
        self._friction_radius = SPOOL_RADIUS * np.array(self.parameters.cable_friction)[list(CABLES)]
        self._data.qpos[self._joint_qpos] = _held_closed(self.parameters)
        self._shaft_joints = np.array([shaft.id for shaft in shafts])
        self._model.jnt_actfrclimited[self._shaft_joints] = 1
        self._current_limits = np.zeros(SHAFTS)
        self._time = 0.0
        # Rows: setpoint, stiffness, damping, torque, limit.
        self._drives = np.zeros((5, SHAFTS))
        for shaft in range(SHAFTS):
            self._apply(shaft, powered=False)

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._time

    def advance_to(self, t: float) -> None:
        """Integrate to exactly `t` (s) with the present drives; nothing happens when `t` is not later than `time`.

        Raises:
            ArithmeticError: the physics diverged.
        """
        span = t - self._time
        if span <= 0.0:
            return
        model, data, step = self._model, self._data, self.parameters.timestep
        if self._friction_radius.any():
            # Between two calls, 10 ms apart at most while the board reads its servos, the friction is held.
            model.dof_frictionloss[self._cable_dofs] = self._spool_friction + self._friction_radius * self._tensions()
        full = int(span / step + TIME_RESOLUTION)
        if full:
            mujoco.mj_step(model, data, full)
        rest = span - full * step
        if rest > TIME_RESOLUTION:
            model.opt.timestep = rest
            mujoco.mj_step(model, data)
            model.opt.timestep = step
        if self._warnings.any():
            # MuJoCo has started over from the initial state by itself; there is nothing to go on with.
            raise ArithmeticError(
                f"the built hand's physics failed between {self._time} and {t} s under the drives (setpoint, "
                f"stiffness, damping, torque, limit; a column a shaft) {self._drives.tolist()}"
            )
        self._time = data.time = t

    def drive(self, shaft: int, drive: DriveLike) -> None:
        """Replace the drive of one shaft (0..6, command order) from now on.

        Raises:
            ValueError: a value that is not finite, or a negative stiffness, damping or limit.
            IndexError: no such shaft.
        """
        self._check(shaft)
        values = (drive.setpoint, drive.stiffness, drive.damping, drive.torque, drive.limit)
        if not all(map(isfinite, values)) or min(drive.stiffness, drive.damping, drive.limit) < 0.0:
            raise ValueError(f"a drive is finite with stiffness, damping and limit not negative, not {drive}")
        if not drive.current_limit >= 0.0:
            raise ValueError(f"a current limit is not negative, not {drive.current_limit}")
        self._drives[:, shaft] = values
        self._current_limits[shaft] = drive.current_limit
        self._apply(shaft, powered=drive.powered)

    def set_setpoint(self, shaft: int, setpoint: float) -> None:
        """Change only the goal angle (rad) of one shaft's present drive; the cheap call a motion profile makes.

        Raises:
            ValueError: not finite.
            IndexError: no such shaft.
        """
        self._check(shaft)
        if not isfinite(setpoint):
            raise ValueError(f"a setpoint is a finite angle in rad, not {setpoint}")
        self._drives[0, shaft] = self._data.ctrl[shaft] = setpoint

    def angles(self) -> NDArray[np.float64]:
        """Return shaft angles, (7,) float, rad, positive closes."""
        angles: NDArray[np.float64] = self._data.qpos[self._shaft_qpos]
        return angles

    def speeds(self) -> NDArray[np.float64]:
        """Return shaft speeds, (7,) float, rad/s."""
        speeds: NDArray[np.float64] = self._data.qvel[self._shaft_dofs]
        return speeds

    def efforts(self) -> NDArray[np.float64]:
        """Return the clipped efforts of the drives at the present state, (7,) float, N m, before back-EMF."""
        setpoint, stiffness, damping, torque, limit = self._drives
        effort = torque + stiffness * (setpoint - self.angles()) - damping * self.speeds()
        return np.clip(effort, -limit, limit)

    def joint_angles(self) -> NDArray[np.float64]:
        """Return the true joint angles, (16,) float, rad, in the order of `Joint`."""
        angles: NDArray[np.float64] = self._data.qpos[self._joint_qpos]
        return angles

    def cable_tensions(self) -> NDArray[np.float64]:
        """Return the true cable tensions at the present state, (7,) float, N, never negative; abduction reads zero."""
        mujoco.mj_forward(self._model, self._data)
        tensions = np.zeros(SHAFTS)
        tensions[list(CABLES)] = self._tensions()
        return tensions

    def slack(self) -> NDArray[np.float64]:
        """Return how much cable is loose, (7,) float, m; zero when taut, and for abduction, which has no cable."""
        mujoco.mj_fwdPosition(self._model, self._data)
        slack = np.zeros(SHAFTS)
        loose = self._data.ten_length[self._cables] - self._model.tendon_range[self._cables, 0]
        slack[list(CABLES)] = np.maximum(loose, 0.0)
        return slack

    def _tensions(self) -> NDArray[np.float64]:
        """Return the tensions of the cables, (6,) float, N, as last solved for, in the order of `CABLES`."""
        data = self._data
        pulling = data.efc_type == TENDON_LIMIT
        forces = np.zeros(self._model.ntendon)
        forces[data.efc_id[pulling]] = data.efc_force[pulling]
        tensions: NDArray[np.float64] = forces[self._cables]
        return tensions

    def _spec(self, hand: Side) -> mujoco.MjSpec:
        """Describe what is simulated; a plant with more around the hand adds it here."""
        return build_built(hand, self.parameters)

    def _check(self, shaft: int) -> None:
        if not 0 <= shaft < SHAFTS:
            raise IndexError(f"shafts are 0..{SHAFTS - 1} in command order, not {shaft}")

    def _apply(self, shaft: int, *, powered: bool) -> None:
        """Write one drive into the physics engine's actuator; its supply scales what an effort is worth."""
        model, supply = self._model, self.parameters.supply_ratio
        setpoint, stiffness, damping, torque, limit = self._drives[:, shaft].tolist()
        self._data.ctrl[shaft] = setpoint
        model.actuator_gainprm[shaft, 0] = supply * stiffness
        model.actuator_biasprm[shaft, :3] = supply * torque, -supply * stiffness, -supply * damping
        model.actuator_forcerange[shaft] = -supply * limit, supply * limit
        model.actuator_biasprm[SHAFTS + shaft, 2] = -self.parameters.back_emf if powered else 0.0
        bound = min(supply * self._current_limits[shaft], UNBOUNDED)
        model.jnt_actfrcrange[self._shaft_joints[shaft]] = -bound, bound


def _held_closed(unit: BuiltHandParameters) -> NDArray[np.float64]:
    """Return the joint angles, (16,) rad, at which cables that are too short are just taut, shafts at zero."""
    angles = np.zeros(len(Joint))
    for channel in CABLES:
        radii = winding(channel, unit)
        own = [joint for joint in radii if radii[joint] > 0.0 and joint is not Joint.THUMB_ABDUCTION]
        angles[own] = max(0.0, -unit.cable_take_up[channel]) / sum(radii[joint] for joint in own)
    return angles
