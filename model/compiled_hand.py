"""Compiled built hand: drives, sheath friction and cable tensions, which MuJoCo does not model by itself.

Shared by the emulated hand (`BuiltHandPlant`) and the batches of training. MuJoCo's data has the motion; this class
updates fields of the model: the drives and the current friction.
"""

import mujoco
import numpy as np

from aero.channels import CABLES, Channel, Joint
from aero.floats import Floats
from firmware_emulator.plant import Drive
from model.built import BINDING, BINDING_RECESS, cable_name, shaft_name, winding
from model.parameters import BuiltHandParameters
from simulator.geometry.winding import SPOOL_RADIUS

SHAFTS = len(Channel)
UNBOUNDED = 1e6
"""Torque bound that never acts, N m."""
HOLDS_CLOSED_M = -5e-4
"""Threshold of the take-up, m; below it a cable keeps its digit partly closed. Springs yield at about 0.2 mm."""
UNPOWERED = Drive(powered=False)


class CompiledHand:
    """Built hand with its surroundings, compiled for MuJoCo; initially unpowered."""

    def __init__(self, spec: mujoco.MjSpec, parameters: BuiltHandParameters) -> None:
        """Compile `spec`.

        Args:
            spec: result of `model.build_built` for `parameters`, possibly with objects added. Sensors of the cable
                tensions (limit forces of the tendons), in the order of `CABLES`, are appended to it.
            parameters: parameters of the hand.
        """
        sensors = [
            spec.add_sensor(
                name=f"{channel.label}_tension",
                type=mujoco.mjtSensor.mjSENS_TENDONLIMITFRC,
                objtype=mujoco.mjtObj.mjOBJ_TENDON,
                objname=cable_name(channel),
            )
            for channel in CABLES
        ]
        spec.compiler.discardvisual = True  # visual geoms cost a seventh of a step
        self.parameters = parameters
        self.supply = parameters.supply_ratio
        """Current supply voltage over nominal."""
        self.model = model = spec.compile()
        joints = [model.joint(joint.label) for joint in Joint]
        shafts = [model.joint(shaft_name(channel)) for channel in Channel]
        cables = list(CABLES)
        self.joint_qpos = np.array([joint.qposadr[0] for joint in joints])
        """Indices of the joint angles, (16,), into `qpos`."""
        self.joint_dofs = np.array([joint.dofadr[0] for joint in joints])
        """Indices of the joint speeds, (16,), into `qvel`."""
        self.shaft_qpos = np.array([shaft.qposadr[0] for shaft in shafts])
        """Indices of the shaft angles, (7,), into `qpos`."""
        self.shaft_dofs = np.array([shaft.dofadr[0] for shaft in shafts])
        """Indices of the shaft speeds, (7,), into `qvel`."""
        self.has_sheaths = any(parameters.cable_friction[channel] for channel in CABLES)
        """True if the friction of the spools depends on the tensions."""
        self._shaft_joints = np.array([shaft.id for shaft in shafts])
        self._cables = np.array([model.tendon(cable_name(channel)).id for channel in CABLES])
        self._binding = model.tendon(BINDING).id if parameters.thumb_binding else None
        first = model.sensor(sensors[0].name).adr[0]
        self.tension_sensors = slice(first, first + len(sensors))
        """Slice of the cable tensions, (6,), in `sensordata`."""
        spools = self.shaft_dofs[cables]
        assert np.all(np.diff(spools) == 1), "the spools follow one another in the order of `CABLES`"
        self._friction = model.dof_frictionloss[spools[0] : spools[-1] + 1]
        self._spool_friction = self._friction.copy()
        self._sheath_radius = SPOOL_RADIUS * np.array(parameters.cable_friction)[cables]
        # Views of MuJoCo's memory, cached because each attribute access creates an array.
        self._gain, self._bias = model.actuator_gainprm, model.actuator_biasprm
        self._force_range, self._torque_range = model.actuator_forcerange, model.jnt_actfrcrange
        # At the nominal supply; rows: stiffness, torque, damping, limit, current limit.
        self._nominal = np.zeros((5, SHAFTS))
        model.actuator_biastype[:] = mujoco.mjtBias.mjBIAS_AFFINE
        model.actuator_forcelimited[:SHAFTS] = 1
        model.jnt_actfrclimited[self._shaft_joints] = 1
        for shaft in range(SHAFTS):
            self.drive(shaft, UNPOWERED)

    def drive(self, shaft: int, drive: Drive) -> None:
        """Set a shaft's actuators to `drive`, except the setpoint, which is a control in MuJoCo's data."""
        self._nominal[:, shaft] = drive.stiffness, drive.torque, drive.damping, drive.limit, drive.current_limit
        self._bias[SHAFTS + shaft, 2] = -self.parameters.back_emf if drive.powered else 0.0
        self._write(slice(shaft, shaft + 1))

    def supply_changed(self, ratio: float) -> None:
        """Scale all drives to a supply voltage of `ratio` times nominal."""
        self.supply = ratio
        self._write(slice(SHAFTS))

    def _write(self, shafts: slice) -> None:
        stiffness, torque, damping, limit, current = self.supply * self._nominal[:, shafts]
        self._gain[shafts, 0], self._bias[shafts, 0] = stiffness, torque
        self._bias[shafts, 1], self._bias[shafts, 2] = -stiffness, -damping
        self._force_range[shafts, 0], self._force_range[shafts, 1] = -limit, limit
        bound = np.minimum(current, UNBOUNDED)
        joints = self._shaft_joints[shafts]
        self._torque_range[joints, 0], self._torque_range[joints, 1] = -bound, bound

    def rub(self, tensions: Floats | float, factors: Floats | float = 1.0) -> None:
        """Update the friction of sheaths and spools.

        Args:
            tensions: cable tensions, (6,), N, in the order of `CABLES`.
            factors: factors on the friction of each sheath, (6,).
        """
        np.add(self._spool_friction, self._sheath_radius * tensions * factors, out=self._friction)

    def bind(self, data: mujoco.MjData) -> None:
        """Move the stop of a thumb that binds to the present flexion of its CMC joint."""
        if self._binding is not None:
            flexion = data.qpos[self.joint_qpos[Joint.THUMB_CMC]]
            stop = self.parameters.thumb_binding - BINDING_RECESS * flexion
            self.model.tendon_range[self._binding] = stop, stop + 2.0 * np.pi

    def tensions(self, data: mujoco.MjData) -> Floats:
        """Return the cable tensions of the last step, (6,), N, in the order of `CABLES`."""
        tensions: Floats = data.sensordata[self.tension_sensors].copy()
        return tensions

    def loose(self, data: mujoco.MjData) -> Floats:
        """Return the slack of each cable in the last computed state, (6,), m; negative if stretched."""
        loose: Floats = data.ten_length[self._cables] - self.model.tendon_range[self._cables, 0]
        return loose

    def at_rest(self) -> tuple[Floats, Floats]:
        """Return joint angles, (16,) rad, and shaft angles, (7,) rad, of a hand before its first drive.

        Pretensioned cables start unwound; driving the shafts to zero winds them in. A cable shorter than
        `HOLDS_CLOSED_M` keeps its digit partly closed with its shaft at zero, as on the recorded thumb.
        """
        joints, shafts = np.zeros(len(Joint)), np.zeros(SHAFTS)
        for channel in CABLES:
            take_up = self.parameters.cable_take_up[channel]
            if take_up >= HOLDS_CLOSED_M:
                shafts[channel] = min(take_up, 0.0) / SPOOL_RADIUS
                continue
            radii = winding(channel, self.parameters)
            own = [joint for joint in radii if radii[joint] > 0.0 and joint is not Joint.THUMB_ABDUCTION]
            joints[own] = -take_up / sum(radii[joint] for joint in own)
        return joints, shafts

    def wound(self, joint_angles: Floats) -> Floats:
        """Return the spool angles, (6,) rad, for just taut cables at `joint_angles` (16,), at least zero."""
        data = mujoco.MjData(self.model)
        data.qpos[self.joint_qpos] = joint_angles
        mujoco.mj_fwdPosition(self.model, data)
        return np.maximum(self.loose(data) / SPOOL_RADIUS, 0.0)
