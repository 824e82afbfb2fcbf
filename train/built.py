"""Built hands in training: behind servos and one-way cables, with the states, controls and sensors of the routed hand.

So a batch may hold both kinds. A state begins as the routed scene's (time, joints and cube, their velocities) and goes
on with angles and velocities of the six spools and the tensions of their cables, which decide the sheaths' friction.
Controls and sensed lengths pass the actuation map, as in deployment.
"""

from __future__ import annotations

import os
from collections.abc import Sequence

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray

from aero.actuation import ActuationMap
from aero.channels import CABLES, OBSERVATION_ORDER, Channel, Joint
from model.built import build_built, cable_name, shaft_name
from model.geometry.winding import SPOOL_RADIUS
from model.parameters import BuiltHandParameters
from model.scene import add_cube
from train.actuation import STALL_TORQUE_N_M
from train.hands import TIMESTEP_S, HandRanges, draw_hand
from train.scene import add_sensors, tip_geoms
from train.simulator import STATE_KIND, Batch, Floats
from train.task.episode import PHYSICS_STEP_S

SERVO_STIFFNESS = 3.8
"""Torque of a servo's inner loop per error, N m/rad: 0.0099 of full duty a count (unit `reference`)."""
SERVO_DAMPING = 0.063
"""Torque of a servo's inner loop per speed, N m s/rad: 1.6e-4 of full duty a count/s (unit `reference`)."""
EXTRA = 3 * len(CABLES)
"""Values by which a built hand's state is longer than the routed hand's."""
SHEATHS_HELD_S = 0.05
"""How long the friction of the sheaths is held, a control period at 20 Hz; the emulated hand looks every 10 ms. Three
policies turned the units `reference` and `paper` with it as with 10 ms, within 0.15 rad/s."""
_STEPS = round(PHYSICS_STEP_S / TIMESTEP_S)
_HELD_STEPS = round(SHEATHS_HELD_S / TIMESTEP_S)
_SHAFTS = len(Channel)
_TENSIONS = slice(-len(CABLES), None)
_TO_COMMAND_ORDER = np.argsort(OBSERVATION_ORDER)
_FORCE_OF_TORQUE = np.where([channel in CABLES for channel in Channel], -1.0 / SPOOL_RADIUS, 1.0)


def build_scene(parameters: BuiltHandParameters, torque_limit: float | None) -> mujoco.MjModel:
    """Return a built right hand with the cube and its servos' inner loops.

    Its sensors are those of `train.task.signals` and then the tensions of the cables. Geoms that nothing
    touches, such as the routed hand's pulleys, are left out: they would cost a fifth of a step.

    Args:
        parameters: of the hand.
        torque_limit: share of the servos' stall torque that they may use; None for all of it. It bounds the winding's
            current, as a goal torque does, not the voltage: a free shaft keeps its speed.
    """
    spec = build_built("right", parameters)
    spec.compiler.discardvisual = True
    add_cube(spec)
    for channel in OBSERVATION_ORDER:
        spec.add_sensor(
            name=channel.label,
            type=mujoco.mjtSensor.mjSENS_JOINTPOS,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            objname=shaft_name(channel),
        )
    add_sensors(spec)
    for channel in Channel:  # what turns the shaft, bounded and less back-EMF
        force = spec.sensor(f"{channel.label}_force")
        force.type, force.objtype = mujoco.mjtSensor.mjSENS_JOINTACTFRC, mujoco.mjtObj.mjOBJ_JOINT
        force.objname = shaft_name(channel)
    spec.nuser_tendon = 1  # what a cable's sheaths take of its tension, for `BuiltSimulator`
    for channel in CABLES:
        spec.tendon(cable_name(channel)).userdata = [parameters.cable_friction[channel]]
        spec.add_sensor(
            name=f"{channel.label}_tension",
            type=mujoco.mjtSensor.mjSENS_TENDONLIMITFRC,
            objtype=mujoco.mjtObj.mjOBJ_TENDON,
            objname=cable_name(channel),
        )
    model = spec.compile()
    supply = parameters.supply_ratio
    stall = supply * STALL_TORQUE_N_M
    bound = stall if torque_limit is None else torque_limit * stall
    model.actuator_biastype[:] = mujoco.mjtBias.mjBIAS_AFFINE
    model.actuator_gainprm[:_SHAFTS, 0] = supply * SERVO_STIFFNESS
    model.actuator_biasprm[:_SHAFTS, 1] = -supply * SERVO_STIFFNESS
    model.actuator_biasprm[:_SHAFTS, 2] = -supply * SERVO_DAMPING
    model.actuator_forcelimited[:_SHAFTS] = 1
    model.actuator_forcerange[:_SHAFTS] = -stall, stall
    model.actuator_biasprm[_SHAFTS:, 2] = -parameters.back_emf
    shafts = [model.joint(shaft_name(channel)).id for channel in Channel]
    model.jnt_actfrclimited[shafts] = 1
    model.jnt_actfrcrange[shafts] = -bound, bound
    return model


def draw_scenes(
    ranges: HandRanges, rng: np.random.Generator, count: int, torque_limit: float | None
) -> list[mujoco.MjModel]:
    """Return `count` hands with the cube."""
    scenes = []
    for _ in range(count):
        model = build_scene(draw_hand(ranges, rng), torque_limit)
        model.geom_friction[tip_geoms(model), 0] = rng.uniform(*ranges.tip_friction)
        scenes.append(model)
    return scenes


class BuiltSimulator(Batch):
    """A batch of built hands over `mujoco.rollout`; holds a thread pool. Use as a context manager, or `close` it."""

    def __init__(
        self, models: Sequence[mujoco.MjModel], corrections: Floats | None = None, threads: int | None = None
    ) -> None:
        """Make a batch.

        Args:
            models: all from `build_scene`, none twice: the friction of its sheaths is written into it.
            corrections: by how much longer each hand's channels are commanded, (batch, 7), m, abduction rad.
            threads: default: all cores.

        Raises:
            ValueError: a model is there twice.
        """
        super().__init__(models)
        if len({id(model) for model in models}) < len(models):
            raise ValueError("every built hand needs a model of its own, for the friction of its sheaths is in it")
        first = self._models[0]
        self._places = _places(first)
        self.state_size = len(self._places) + len(CABLES)
        self._corrections = np.zeros((len(models), 1, _SHAFTS)) if corrections is None else corrections[:, None]
        self._spools = [first.joint(shaft_name(channel)).dofadr[0] for channel in CABLES]
        self._spool_friction = np.array([model.dof_frictionloss[self._spools] for model in models])
        cables = [first.tendon(cable_name(channel)).id for channel in CABLES]
        self._sheath_radius = SPOOL_RADIUS * np.array([model.tendon_user[cables, 0] for model in models])
        threads = threads or os.cpu_count() or 1
        self._map = ActuationMap()
        self._data = [mujoco.MjData(first) for _ in range(threads)]
        self._pool = rollout.Rollout(nthread=threads)

    def close(self) -> None:
        """Stop the threads."""
        self._pool.close()

    def advance(self, states: Floats, controls: Floats) -> tuple[Floats, Floats]:
        """Step every scene, see `Batch`."""
        full, tensions = np.empty((len(states), len(self._places))), states[:, _TENSIONS]
        full[:, self._places] = states[:, : len(self._places)]
        angles = np.zeros((len(states), controls.shape[1] * _STEPS, self._models[0].nu))
        setpoints = self._map.angles_from_travel(self._map.travel_from_lengths(controls + self._corrections))
        angles[:, :, :_SHAFTS] = np.repeat(setpoints, _STEPS, axis=1)
        sensors = []
        for start in range(0, angles.shape[1], _HELD_STEPS):
            self._rub(tensions)
            trajectory, sensed = self._pool.rollout(
                self._models, self._data, full, angles[:, start : start + _HELD_STEPS]
            )
            full, tensions = trajectory[:, -1], sensed[:, -1, _TENSIONS]
            sensors.append(sensed[:, _STEPS - 1 :: _STEPS, : _TENSIONS.start])
        self._rub(np.zeros_like(tensions))  # the models are as they were
        return np.hstack([full[:, self._places], tensions]), self._as_routed(np.hstack(sensors))

    def _rub(self, tensions: Floats) -> None:
        """Set the dry friction of spools and sheaths, given the cables' tensions, (batch, 6), N."""
        friction = self._spool_friction + self._sheath_radius * tensions
        for model, row in zip(self._models, friction, strict=True):
            model.dof_frictionloss[self._spools] = row

    def at(self, starts: Floats) -> Floats:
        """Return states at rest at `starts` (batch, 23), with every cable just taut."""
        states = super().at(starts)
        spools = slice(self.state_size - EXTRA, self.state_size - EXTRA + len(CABLES))
        for state, start, model in zip(states, starts, self._models, strict=True):
            state[spools] = _taut(model, start)
        return states

    def _as_routed(self, sensors: Floats) -> Floats:
        """Turn shaft angles into the simulator's lengths, and torques of shafts into forces that lengthen."""
        sensors = sensors.copy()
        angles = sensors[..., :_SHAFTS][..., _TO_COMMAND_ORDER]
        lengths = self._map.lengths_from_travel(self._map.travel_from_angles(angles)) - self._corrections
        sensors[..., :_SHAFTS] = lengths[..., list(OBSERVATION_ORDER)]
        sensors[..., _SHAFTS : 2 * _SHAFTS] *= _FORCE_OF_TORQUE
        return sensors


class MixedSimulator(Batch):
    """Two batches as one: routed hands first, then built ones; whoever made them closes them."""

    def __init__(self, routed: Batch, built: BuiltSimulator) -> None:
        super().__init__(routed.models + built.models)
        self._routed, self._built = routed, built
        self.state_size = built.state_size

    def advance(self, states: Floats, controls: Floats) -> tuple[Floats, Floats]:
        """Step every scene, see `Batch`."""
        n = len(self._routed)
        routed, routed_sensors = self._routed.advance(states[:n, :-EXTRA], controls[:n])
        built, built_sensors = self._built.advance(states[n:], controls[n:])
        return np.concatenate([_padded(routed), built]), np.concatenate([routed_sensors, built_sensors])

    def at(self, starts: Floats) -> Floats:
        """Return states at rest at `starts`, see `Batch`."""
        n = len(self._routed)
        return np.concatenate([_padded(self._routed.at(starts[:n])), self._built.at(starts[n:])])


def _padded(states: Floats) -> Floats:
    return np.pad(states, ((0, 0), (0, EXTRA)))


def _places(model: mujoco.MjModel) -> NDArray[np.int_]:
    """Return where each value of a training state lies in MuJoCo's state of a built scene."""
    joints = [model.joint(joint.label) for joint in Joint]
    spools = [model.joint(shaft_name(channel)) for channel in CABLES]
    cube = model.joint("cube")
    positions = [joint.qposadr[0] for joint in joints] + [cube.qposadr[0] + k for k in range(7)]
    velocities = [joint.dofadr[0] for joint in joints] + [cube.dofadr[0] + k for k in range(6)]
    first, second = 1, 1 + model.nq
    places = [0, *(first + np.array(positions)), *(second + np.array(velocities))]
    places += [first + spool.qposadr[0] for spool in spools] + [second + spool.dofadr[0] for spool in spools]
    if sorted(places) != list(range(mujoco.mj_stateSize(model, STATE_KIND))):
        raise ValueError("a built scene has one state value for each joint, spool and coordinate of the cube")
    return np.array(places)


def _taut(model: mujoco.MjModel, start: Floats) -> Floats:
    """Return the spools' angles, (6,) rad, at which the cables of a hand at `start` (23,) are just taut."""
    data = mujoco.MjData(model)
    for joint, angle in zip(Joint, start[: len(Joint)], strict=True):
        data.joint(joint.label).qpos[0] = angle
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_tendon(model, data)
    lengths = np.array([data.ten_length[model.tendon(cable_name(channel)).id] for channel in CABLES])
    slack = np.array([model.tendon_range[model.tendon(cable_name(channel)).id, 0] for channel in CABLES])
    angles: Floats = np.maximum((lengths - slack) / SPOOL_RADIUS, 0.0)
    return angles
