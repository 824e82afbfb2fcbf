"""The routed hand: spatial tendons over pulleys, the simulator that the policy trains on.

Everything here reproduces the released tendon model of the Aero Hand Open (`AeroCubeRotateZAxis`, MuJoCo Playground
0.2.0); the geometry is in `model.geometry`.
"""

from __future__ import annotations

import mujoco
import numpy as np

from aero.channels import FINGERS, OBSERVATION_ORDER, Channel
from model.appearance import CABLE_RGBA, CABLE_WIDTH
from model.geometry import Side, hand
from model.geometry.elements import Around, Cable
from model.skeleton import build_skeleton, couple, released_dynamics

TIMESTEP = 0.010
"""s"""
CABLE_GAIN = 1e4
"""Position gain of the six cable actuators, N/m."""
ABDUCTION_GAIN = 1.0
"""Position gain of the abduction actuator, N m/rad."""

TENDONS: dict[Channel, str] = {
    **{finger: f"{finger.label}_cable" for finger in FINGERS},
    Channel.THUMB_CMC_FLEXION: "thumb_cmc_cable",
    Channel.THUMB_FLEXOR: "thumb_flexor_cable",
}
"""Tendon behind each cable channel; abduction acts on its joint."""

COMMAND_RANGE: dict[Channel, tuple[float, float]] = {
    **dict.fromkeys(FINGERS, (0.058520, 0.110387)),
    Channel.THUMB_ABDUCTION: (-0.1, 1.75),
    Channel.THUMB_CMC_FLEXION: (0.026152, 0.038389),
    Channel.THUMB_FLEXOR: (0.081568, 0.112138),
}
"""Calibrated command intervals, m (abduction rad); paper, "Actuation interface", at the released model's digits."""


def build_routed(side: Side = "right") -> mujoco.MjSpec:
    """Build the routed hand.

    Sixteen hinge joints in the order of `Joint`, twenty spatial tendons, seven position actuators in command order
    and seven sensors in observation order, both named by `Channel.label`, five joint equalities.

    Args:
        side: which hand.

    Returns:
        A spec that compiles as it is; add objects with `model.scene` before that.

    Raises:
        ValueError: `side` is neither `right` nor `left`.
    """
    description = hand(side)
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
