"""Built hands in training: servos and one-way cables behind the states, controls and sensors of the routed hand.

One task therefore serves both kinds of hand. A state is the routed scene's state (time, joints and cube, velocities)
plus angles and velocities of the six spools and the cable tensions, which determine the sheath friction. Controls and
sensed lengths pass the actuation map, as in deployment.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from aero.actuation import ActuationMap
from aero.channels import CABLES, OBSERVATION_ORDER, Channel, Joint
from aero.floats import Floats
from model.built import build_built, shaft_name
from model.compiled_hand import CompiledHand
from model.units import Unit
from simulator.geometry.winding import SPOOL_RADIUS
from simulator.scene import CUBE, Cube, add_cube
from train.hands import TIMESTEP_S, in_training
from train.simulator import STATE_KIND, Simulator, add_sensors
from train.task import PHYSICS_STEP_S

EXTRA = 3 * len(CABLES)
"""Number of values that a built hand's state adds to the routed hand's."""
SHEATHS_HELD_S = 0.05
"""Update period of the sheath friction, s: one control period at 20 Hz; the emulated hand updates every 10 ms.

With both periods, three policies turned the cube on the units `reference` and `paper` equally fast within 0.15 rad/s.
"""
_STEPS = round(PHYSICS_STEP_S / TIMESTEP_S)
_HELD_STEPS = round(SHEATHS_HELD_S / TIMESTEP_S)
_SHAFTS = len(Channel)
_TENSIONS = slice(-len(CABLES), None)
_TO_COMMAND_ORDER = np.argsort(OBSERVATION_ORDER)
_FORCE_OF_TORQUE = np.where([channel in CABLES for channel in Channel], -1.0 / SPOOL_RADIUS, 1.0)


def build_scene(unit: Unit, torque_limit: float | None, cube: Cube = CUBE) -> CompiledHand:
    """Return a built right hand with the cube at training's step, its servos driven in position mode.

    Its sensors are those of `train.task`, followed by the cable tensions.

    Args:
        unit: the hand.
        torque_limit: bound of the torque, fraction of the stall torque; None for no bound. It limits the winding
            current, like the servo's torque limit, so the free speed is unchanged.
        cube: the cube to rotate.
    """
    parameters = in_training(unit).hand
    spec = build_built("right", parameters)
    add_cube(spec, cube)
    for channel in OBSERVATION_ORDER:
        spec.add_sensor(
            name=channel.label,
            type=mujoco.mjtSensor.mjSENS_JOINTPOS,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            objname=shaft_name(channel),
        )
    add_sensors(spec)
    for channel in Channel:  # Torque at the shaft after the limit and the back-EMF.
        force = spec.sensor(f"{channel.label}_force")
        force.type, force.objtype = mujoco.mjtSensor.mjSENS_JOINTACTFRC, mujoco.mjtObj.mjOBJ_JOINT
        force.objname = shaft_name(channel)
    # MuJoCo 3's implicit integrator damps a torque-limited shaft with the back-EMF, which costs a fifth of the
    # acceleration at 5 ms. Euler's integrator, the emulated hand's 2 ms and MuJoCo 4 do not.
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    scene = CompiledHand(spec, parameters)
    for channel in Channel:
        scene.drive(channel, unit.position_drive(1.0 if torque_limit is None else torque_limit))
    return scene


class BuiltSimulator(Simulator):
    """Batch of built hands over `mujoco.rollout` with its own thread pool; a context manager."""

    def __init__(
        self, scenes: Sequence[CompiledHand], corrections: Floats | None = None, threads: int | None = None
    ) -> None:
        """Create a batch.

        Args:
            scenes: distinct results of `build_scene`; the batch writes the sheath friction into each.
            corrections: cable-length corrections added to the commands, (batch, 7), m, abduction rad.
            threads: number of threads; None for all cores.
        """
        super().__init__([scene.model for scene in scenes], threads)
        self._scenes = list(scenes)
        self._indices = _state_indices(self.models[0])
        self.state_size = len(self._indices) + len(CABLES)
        self._corrections = (
            np.zeros((len(scenes), 1, _SHAFTS)) if corrections is None else np.array(corrections)[:, None]
        )
        self._map = ActuationMap()

    def replace(self, slot: int, scene: CompiledHand, correction: Floats, facts: Floats) -> None:
        """Replace the hand, its correction (7,) and its constants for the critic (HAND_FACTS,) in a slot."""
        self.models[slot], self._scenes[slot] = scene.model, scene
        self._corrections[slot, 0], self.facts[slot] = correction, facts

    def part(self, slots: Sequence[int], threads: int | None = None) -> BuiltSimulator:
        """Return the hands of these slots as a separate batch."""
        part = BuiltSimulator([self._scenes[slot] for slot in slots], self._corrections[slots, 0], threads)
        part.facts = self.facts[slots]
        return part

    def advance(self, states: Floats, controls: Floats) -> tuple[Floats, Floats]:
        """Step every scene; see `Simulator.advance`."""
        full, tensions = np.empty((len(states), len(self._indices))), states[:, _TENSIONS]
        full[:, self._indices] = states[:, : len(self._indices)]
        angles = np.zeros((len(states), controls.shape[1] * _STEPS, self.models[0].nu))
        setpoints = self._map.angles_from_travel(self._map.travel_from_lengths(controls + self._corrections))
        angles[:, :, :_SHAFTS] = np.repeat(setpoints, _STEPS, axis=1)
        sensors = []
        for start in range(0, angles.shape[1], _HELD_STEPS):
            for scene, tension in zip(self._scenes, tensions, strict=True):
                scene.rub(tension)
            full, sensed = super().advance(full, angles[:, start : start + _HELD_STEPS])
            tensions = sensed[:, -1, _TENSIONS]
            sensors.append(sensed[:, _STEPS - 1 :: _STEPS, : _TENSIONS.start])
        return np.hstack([full[:, self._indices], tensions]), self._as_routed(np.hstack(sensors))

    def at(self, starts: Floats) -> Floats:
        """Return states at rest at `starts` (batch, 23), with each cable just taut."""
        states = super().at(starts)
        spools = slice(self.state_size - EXTRA, self.state_size - EXTRA + len(CABLES))
        for state, start, scene in zip(states, starts, self._scenes, strict=True):
            state[spools] = scene.wound(start[: len(Joint)])
        return states

    def _as_routed(self, sensors: Floats) -> Floats:
        """Convert shaft angles to cable lengths, and shaft torques to forces that lengthen a cable."""
        sensors = sensors.copy()
        angles = sensors[..., :_SHAFTS][..., _TO_COMMAND_ORDER]
        lengths = self._map.lengths_from_travel(self._map.travel_from_angles(angles)) - self._corrections
        sensors[..., :_SHAFTS] = lengths[..., list(OBSERVATION_ORDER)]
        sensors[..., _SHAFTS : 2 * _SHAFTS] *= _FORCE_OF_TORQUE
        return sensors


def _state_indices(model: mujoco.MjModel) -> NDArray[np.int_]:
    """Return the index of each training-state value in MuJoCo's state of a built scene."""
    joints = [model.joint(joint.label) for joint in Joint]
    spools = [model.joint(shaft_name(channel)) for channel in CABLES]
    cube = model.joint("cube")
    positions = [joint.qposadr[0] for joint in joints] + [cube.qposadr[0] + k for k in range(7)]
    velocities = [joint.dofadr[0] for joint in joints] + [cube.dofadr[0] + k for k in range(6)]
    first, second = 1, 1 + model.nq
    indices = [0, *(first + np.array(positions)), *(second + np.array(velocities))]
    indices += [first + spool.qposadr[0] for spool in spools] + [second + spool.dofadr[0] for spool in spools]
    if sorted(indices) != list(range(mujoco.mj_stateSize(model, STATE_KIND))):
        raise ValueError("a built scene has one state value for each joint, spool and coordinate of the cube")
    return np.array(indices)
