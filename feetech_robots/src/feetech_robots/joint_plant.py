"""Plant for any MJCF file: one geared servo shaft per joint.

The inner loop of each servo is an actuator of the physics engine, as in `model.plant`, and replaces the actuators of
the file. Inertia, friction, damping, ranges, contacts and gravity of the file are kept.
"""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from aero.exit_code import Exit
from aero.regular_file import LFS_POINTER, MIB
from firmware_emulator.plant import Drive, Plant, ShaftState

UNBOUNDED = 1e6
"""Torque bound without effect, N m."""
UNPOWERED = Drive(powered=False)
HAND_STIFFNESS, HAND_DAMPING = 50.0, 5.0
"""Stiffness and damping of a human hand on a joint, N m/rad and N m s/rad (assumption)."""
SLACK_RAD = math.radians(1.0)
"""Tolerance beyond the joint range for a held angle, rad."""


SMALLER_STEP = "try a smaller <option timestep>, here {step:g} s, armature on the joint, or less stiffness and damping"
REMEDIES = {
    mujoco.mjtWarning.mjWARN_INERTIA: "give the body behind it more mass and inertia, or the joint armature",
    mujoco.mjtWarning.mjWARN_CONTACTFULL: 'give it more memory, <size memory="..."/>, or exclude contacts',
    mujoco.mjtWarning.mjWARN_CNSTRFULL: 'give it more memory, <size memory="..."/>, or exclude contacts',
    mujoco.mjtWarning.mjWARN_BADQPOS: SMALLER_STEP,
    mujoco.mjtWarning.mjWARN_BADQVEL: SMALLER_STEP,
    mujoco.mjtWarning.mjWARN_BADQACC: SMALLER_STEP,
}
"""Remedy for each warning of MuJoCo."""


class PhysicsFailedError(ArithmeticError):
    """User's model that cannot be simulated; the message names file, joint, time and remedy."""

    exit_code = Exit.USAGE


@dataclass(frozen=True)
class GearedShaft:
    """Joint of the file, driven by a servo's shaft through a gear."""

    joint: str
    """Name of a hinge joint."""
    back_emf: float
    """Loss of effort per speed by back-EMF, N m s/rad at the shaft."""
    gear: float = 1.0
    """Turns of the shaft per turn of the joint, not zero."""
    start: float = 0.0
    """Angle of the joint at time zero, rad."""
    damping: float | None = None
    """Damping of the joint excluding back-EMF, N m s/rad; None for the value of the file."""


class JointPlant(Plant):
    """Output shafts on the joints of an MJCF file, initially at rest and unpowered. Deterministic."""

    def __init__(self, path: Path, shafts: Sequence[GearedShaft]) -> None:
        """Compile the file with servo actuators on each joint.

        Raises:
            ValueError: invalid MJCF or URDF, a missing or non-hinge joint, or a gear of zero.
            OSError: the file cannot be read.
        """
        if not path.is_file():
            raise FileNotFoundError(f"{path}: no such file")
        self._path = path
        with _of_mujoco(path):
            spec = mujoco.MjSpec.from_file(str(path))
        _replace_actuators(spec, path, shafts)
        self.shafts = tuple(shafts)
        with _of_mujoco(path):
            self.model = model = spec.compile()
        self.data = mujoco.MjData(model)
        joints = [model.joint(shaft.joint) for shaft in shafts]
        self._joints = [joint.id for joint in joints]
        self._qpos = np.array([joint.qposadr[0] for joint in joints])
        self._dofs = np.array([joint.dofadr[0] for joint in joints])
        self._gears = np.array([shaft.gear for shaft in shafts])
        self._count = len(shafts)
        self._held: dict[int, float] = {}
        self._drives = [UNPOWERED] * self._count
        self._setpoints = np.zeros(self._count)
        self._time = 0.0
        self.moved: list[str] = []
        """Messages about joints that cannot start at angle zero."""
        self.data.qpos[self._qpos] = [self._start(shaft) for shaft in shafts]
        for dof, geared in zip(self._dofs, shafts, strict=True):
            if geared.damping is not None:
                model.dof_damping[dof] = geared.damping
        for shaft in range(self._count):
            self.drive(shaft, UNPOWERED)

    def _start(self, shaft: GearedShaft) -> float:
        """Return the initial angle (rad) of a joint: 0 is clipped to the joint's range, to avoid a violent start.

        Raises:
            ValueError: a requested start angle is outside the range.
        """
        joint = self.model.joint(shaft.joint)
        if not self.model.jnt_limited[joint.id] or joint.range[0] <= shaft.start <= joint.range[1]:
            return shaft.start
        span = f"{math.degrees(joint.range[0]):g} to {math.degrees(joint.range[1]):g} degrees"
        if shaft.start != 0.0:
            raise ValueError(
                f"{self._path}: {shaft.joint} turns {span}, and cannot start at {math.degrees(shaft.start):g}"
            )
        nearest = float(np.clip(0.0, *joint.range))
        self.moved.append(
            f"{shaft.joint} turns {span}, so it starts at {math.degrees(nearest):g}; start_deg says where"
        )
        return nearest

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._time

    def advance_to(self, t: float) -> None:
        """Integrate to exactly `t` (s) with the present drives; no effect unless `t` is later than `time`.

        Raises:
            PhysicsFailedError: the physics diverged.
        """
        span = t - self._time
        if span <= 0.0:
            return
        model, step = self.model, self.model.opt.timestep
        full = int(span / step + 1e-9)
        # By default MuJoCo prints warnings and writes them to a file in the working folder.
        said = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(_ignore)
        try:
            if full:
                mujoco.mj_step(model, self.data, full)
            rest = span - full * step
            if rest > 1e-9:
                model.opt.timestep = rest
                mujoco.mj_step(model, self.data)
                model.opt.timestep = step
        finally:
            mujoco.set_mju_user_warning(said)
        if self.data.warning.number.any():
            # MuJoCo has reset itself to the initial state, so the simulation cannot continue.
            raise PhysicsFailedError(self._failure(t))
        self._time = self.data.time = t

    def _failure(self, t: float) -> str:
        kind = next(kind for kind in mujoco.mjtWarning.__members__.values() if self.data.warning[kind].number)
        at = self.data.warning[kind].lastinfo
        where = ""
        if kind is mujoco.mjtWarning.mjWARN_BADQPOS:
            where = self.model.joint(int(np.searchsorted(self.model.jnt_qposadr, at, "right")) - 1).name
        elif REMEDIES[kind] is not REMEDIES[mujoco.mjtWarning.mjWARN_CONTACTFULL] and at < self.model.nv:
            where = self.model.joint(self.model.dof_jntid[at]).name
        return (
            f"{self._path}: MuJoCo cannot simulate it{f' at joint {where!r}' if where else ''}, between "
            f"{self._time:.3f} and {t:.3f} s ({mujoco.mju_warningText(kind, at)}); "
            f"{REMEDIES[kind].format(step=self.model.opt.timestep)}"
        )

    def drive(self, shaft: int, drive: Drive) -> None:
        """Replace the drive of one shaft.

        Raises:
            IndexError: `shaft` is out of range.
        """
        model, gear = self.model, self.shafts[shaft].gear
        self._drives[shaft] = drive
        model.actuator_gainprm[shaft, 0] = drive.stiffness
        model.actuator_biasprm[shaft, :3] = drive.torque, -drive.stiffness, -drive.damping
        model.actuator_forcerange[shaft] = -drive.limit, drive.limit
        motor = self._count + shaft
        model.actuator_biasprm[motor, 2] = -self.shafts[shaft].back_emf if drive.powered else 0.0
        bound = min(drive.current_limit * abs(gear), UNBOUNDED)
        model.jnt_actfrcrange[self._joints[shaft]] = -bound, bound
        self.set_setpoint(shaft, drive.setpoint)
        self._grip(shaft)

    def set_setpoint(self, shaft: int, setpoint: float) -> None:
        """Change only the goal angle (rad) of one shaft's present drive."""
        self._setpoints[shaft] = self.data.ctrl[shaft] = setpoint

    def state(self) -> ShaftState:
        """Return angles, speeds and efforts of the shafts at once."""
        angles = (self.data.qpos[self._qpos] * self._gears).tolist()
        speeds = (self.data.qvel[self._dofs] * self._gears).tolist()
        efforts = map(Drive.effort, self._drives, self._setpoints.tolist(), angles, speeds)
        return ShaftState(angles, speeds, [*efforts])

    def joint_angles(self) -> NDArray[np.float64]:
        """Return the true joint angles, (n,) float, rad, in the order of the shafts."""
        return np.array(self.data.qpos[self._qpos])

    def hold(self, shaft: int, angle: float | None) -> None:
        """Hold a joint at an angle (rad), like a human hand, while its servo is off; None releases the joint.

        Raises:
            IndexError: `shaft` is out of range.
            ValueError: an angle that is not finite or outside the joint's range.
        """
        if not 0 <= shaft < self._count:
            raise IndexError(f"shafts are 0 to {self._count - 1}, not {shaft}")
        if angle is None:
            self._held.pop(shaft, None)
        else:
            joint = self._joints[shaft]
            low, high = self.model.jnt_range[joint] if self.model.jnt_limited[joint] else (-math.tau, math.tau)
            if not low - SLACK_RAD <= angle <= high + SLACK_RAD:
                raise ValueError(
                    f"{self.shafts[shaft].joint} reaches {math.degrees(low):.0f} to {math.degrees(high):.0f} degrees, "
                    f"not {math.degrees(angle):g}"
                )
            self._held[shaft] = angle
        self._grip(shaft)

    def _grip(self, shaft: int) -> None:
        hand = 2 * self._count + shaft
        holds = shaft in self._held and not self._drives[shaft].powered
        stiffness, damping = (HAND_STIFFNESS, HAND_DAMPING) if holds else (0.0, 0.0)
        self.model.actuator_gainprm[hand, 0] = stiffness
        self.model.actuator_biasprm[hand, 1:3] = -stiffness, -damping
        self.data.ctrl[hand] = self._held.get(shaft, 0.0)


def _is_pointer(path: Path) -> bool:
    try:
        return path.is_file() and path.stat().st_size < MIB and path.read_bytes().startswith(LFS_POINTER)
    except OSError:
        return False


def _ignore(text: str) -> None:
    """Ignore a warning, as `PhysicsFailedError` reports it."""


@contextmanager
def _of_mujoco(path: Path) -> Iterator[None]:
    """Turn the various errors of MuJoCo into a ValueError that names the file."""
    try:
        yield
    except (ValueError, RuntimeError, TypeError, mujoco.FatalError, mujoco.UnexpectedError) as error:
        pointers = (one.name for one in path.parent.rglob("*") if one.name in str(error) and _is_pointer(one))
        lfs = "".join(f"; {name} is a Git LFS pointer: run `git lfs pull`" for name in pointers)
        raise ValueError(f"{path}: MuJoCo does not read it: {error}{lfs}") from error


def _replace_actuators(spec: mujoco.MjSpec, path: Path, shafts: Sequence[GearedShaft]) -> None:
    # Implicit in the speed, as required by the servos' damping and the motors' back-EMF.
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    # Keyframes are deleted too: they contain one control per actuator of the file.
    for element in [*spec.actuators, *spec.keys]:
        spec.delete(element)
    for shaft in shafts:
        joint = spec.joint(shaft.joint)
        if joint is None or joint.type != mujoco.mjtJoint.mjJNT_HINGE:
            names = ", ".join(joint.name for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_HINGE)
            raise ValueError(f"{path}: no hinge joint {shaft.joint!r}; it has {names or 'none'}")
        if not shaft.gear:
            raise ValueError(f"{path}: the gear of {shaft.joint} is 0")
        joint.actfrclimited = mujoco.mjtLimited.mjLIMITED_TRUE
        joint.actfrcrange = -UNBOUNDED, UNBOUNDED
    # Back-EMF is an actuator too, so that the force limit of the joint's actuators bounds the winding current.
    for kind in ("servo", "motor", "hand"):
        for at, shaft in enumerate(shafts):
            spec.add_actuator(
                name=f"{kind} {at} {shaft.joint}",
                trntype=mujoco.mjtTrn.mjTRN_JOINT,
                target=shaft.joint,
                gear=[1.0 if kind == "hand" else shaft.gear, 0, 0, 0, 0, 0],
                gaintype=mujoco.mjtGain.mjGAIN_FIXED,
                biastype=mujoco.mjtBias.mjBIAS_AFFINE,
                gainprm=[0.0] * 10,
                biasprm=[0.0] * 10,
                forcelimited=kind == "servo",
                forcerange=[-1.0, 1.0],
            )
