"""Routed hand: spatial tendons over pulleys, the simulator of the paper's training.

Reproduces the released tendon model of the Aero Hand Open (`AeroCubeRotateZAxis`, MuJoCo Playground 0.2.0) with the
geometry of `simulator.geometry`.
"""

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.channels import FINGERS, OBSERVATION_ORDER, Channel
from aero.side import Side
from simulator.appearance import CABLE_RGBA, CABLE_WIDTH
from simulator.geometry import hand_geometry
from simulator.geometry.elements import Around, Cable
from simulator.skeleton import build_skeleton, couple, released_dynamics

TIMESTEP = 0.010
"""Physics step, s."""
CABLE_GAIN = 1e4
"""Position gain of the six cable actuators, N/m."""
ABDUCTION_GAIN = 1.0
"""Position gain of the abduction actuator, N m/rad."""

TENDONS: dict[Channel, str] = {
    **{finger: f"{finger.label}_cable" for finger in FINGERS},
    Channel.THUMB_CMC_FLEXION: "thumb_cmc_cable",
    Channel.THUMB_FLEXOR: "thumb_flexor_cable",
}
"""Tendon of each cable channel; the abduction actuator drives its joint directly."""

COMMAND_RANGE: dict[Channel, tuple[float, float]] = {
    **dict.fromkeys(FINGERS, (0.058520, 0.110387)),
    Channel.THUMB_ABDUCTION: (-0.1, 1.75),
    Channel.THUMB_CMC_FLEXION: (0.026152, 0.038389),
    Channel.THUMB_FLEXOR: (0.081568, 0.112138),
}
"""Calibrated command intervals, m (abduction rad). Source: paper, "Actuation interface", at the released model's
precision."""


def build_routed(side: Side = "right") -> mujoco.MjSpec:
    """Build the routed hand.

    Sixteen hinge joints in the order of `Joint`, twenty spatial tendons, seven position actuators in command order
    and seven sensors in observation order, both named by `Channel.label`, five joint equalities.

    Args:
        side: side of the hand.

    Returns:
        A spec ready to compile; `simulator.scene` can add objects first.

    Raises:
        ValueError: `side` is neither `right` nor `left`.
    """
    description = hand_geometry(side)
    spec = build_skeleton(description, released_dynamics(description))
    spec.modelname = f"aero_routed_{side}"
    spec.option.timestep = TIMESTEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_EULERDAMP
    spec.option.iterations = 5
    spec.option.ls_iterations = 8
    couple(spec, description)
    for cable in description.cables:
        _add_cable(spec, cable)
    for channel in Channel:
        _add_actuator(spec, channel)
    for channel in OBSERVATION_ORDER:
        _add_sensor(spec, channel)
    return spec


def _add_cable(spec: mujoco.MjSpec, cable: Cable) -> None:
    spring = {}
    if cable.spring:
        spring = {"stiffness": cable.spring.stiffness, "springlength": np.full(2, cable.spring.rest_length)}
    tendon = spec.add_tendon(name=cable.name, rgba=CABLE_RGBA[cable.role], width=CABLE_WIDTH, **spring)
    for stop in cable.path:
        if isinstance(stop, Around):
            tendon.wrap_geom(stop.pulley, stop.side or "")
        else:
            tendon.wrap_site(stop)


def _add_actuator(spec: mujoco.MjSpec, channel: Channel) -> None:
    tendon = TENDONS.get(channel)
    actuator = spec.add_actuator(
        name=channel.label,
        trntype=mujoco.mjtTrn.mjTRN_TENDON if tendon else mujoco.mjtTrn.mjTRN_JOINT,
        target=tendon or channel.label,
        ctrllimited=mujoco.mjtLimited.mjLIMITED_TRUE,
        ctrlrange=COMMAND_RANGE[channel],
    )
    actuator.set_to_position(kp=CABLE_GAIN if tendon else ABDUCTION_GAIN)


def _add_sensor(spec: mujoco.MjSpec, channel: Channel) -> None:
    tendon = TENDONS.get(channel)
    spec.add_sensor(
        name=channel.label,
        type=mujoco.mjtSensor.mjSENS_TENDONPOS if tendon else mujoco.mjtSensor.mjSENS_JOINTPOS,
        objtype=mujoco.mjtObj.mjOBJ_TENDON if tendon else mujoco.mjtObj.mjOBJ_JOINT,
        objname=tendon or channel.label,
    )


class RoutedHand:
    """Deterministic simulator of the routed hand without objects.

    The initial state, restored by `reset`, is the extended pose at rest under the command for that pose.
    """

    def __init__(self, side: Side = "right") -> None:
        self._model = build_routed(side).compile()
        self._data = mujoco.MjData(self._model)
        # View of MuJoCo's memory, cached because each attribute access creates an array.
        self._sensors = self._data.sensordata
        self._order = np.array([self._model.sensor(channel.label).adr[0] for channel in Channel])
        self.command_range: NDArray[np.float64] = np.array([COMMAND_RANGE[channel] for channel in Channel])
        """Admissible commands, (7, 2) float, command order; m, abduction rad."""
        self.reset()

    def reset(self) -> None:
        """Restore the extended pose at rest and its command, at time zero."""
        mujoco.mj_resetData(self._model, self._data)
        mujoco.mj_forward(self._model, self._data)
        self.command(np.clip(self.lengths(), *self.command_range.T))

    def command(self, lengths: ArrayLike) -> None:
        """Set the goals of the seven actuators.

        Args:
            lengths: (7,) float, command order; cable lengths in m, abduction in rad, within `command_range`.

        Raises:
            ValueError: wrong shape, not finite, or out of range.
        """
        goal = np.asarray(lengths, dtype=float)
        if goal.shape != (len(Channel),):
            raise ValueError(f"a command has shape (7,), command order, not {goal.shape}")
        for channel, value in zip(Channel, goal.tolist(), strict=True):
            low, high = COMMAND_RANGE[channel]
            if not low <= value <= high:
                within = f"[{low}, {high}]; clip it to `command_range` if that is meant"
                raise ValueError(f"{channel.label}: command {value} is outside {within}")
        self._data.ctrl[:] = goal

    def advance(self, seconds: float) -> None:
        """Integrate for `seconds`, a whole number of 10 ms steps.

        Raises:
            ValueError: negative, or not a multiple of the step.
        """
        steps = round(seconds / TIMESTEP)
        if steps < 0 or abs(steps * TIMESTEP - seconds) > 1e-6:
            raise ValueError(f"{seconds} s is not a whole number of {TIMESTEP} s steps")
        # The two halves of mj_step in reverse order, so that the sensors are computed from the final positions.
        for _ in range(steps):
            mujoco.mj_step2(self._model, self._data)
            mujoco.mj_step1(self._model, self._data)

    def lengths(self) -> NDArray[np.float64]:
        """Return the current sensor readings, (7,) float, command order; cable lengths in m, abduction in rad."""
        lengths: NDArray[np.float64] = self._sensors.take(self._order)
        return lengths

    def joint_angles(self) -> NDArray[np.float64]:
        """Return the joint angles, (16,) float, rad, in the order of `Joint`."""
        angles: NDArray[np.float64] = self._data.qpos.copy()
        return angles
