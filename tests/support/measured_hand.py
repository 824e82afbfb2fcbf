"""Measurements of the built hand for tests and docs/internals/hand_model.md: stops, loads, forces, a step."""

import mujoco
import numpy as np
from servo_law import COUNT, STALL, push, settle, towards

from aero.channels import FINGERS, Channel, Joint
from firmware_emulator.plant import Drive
from model import BuiltHandPlant, build_built

FINGER_SPAN = np.deg2rad(288.16)
CMC_SPAN = np.deg2rad(104.13)
FLEXOR_ENDS = np.deg2rad([-15.28, 247.15])
BLOCKED = 0.33
"""Effort at the 3.0-3.4 A of the recorded hand at a stop, N m."""
OPEN_RAD = 0.02
"""Threshold of a joint angle, rad; below it the joint counts as open."""


def blocked_finger(finger: Channel) -> float:
    """Return the stop of a finger, fraction of its window."""
    plant = BuiltHandPlant()
    plant.drive(finger, towards(FINGER_SPAN, limit=BLOCKED))
    settle(plant)
    return float(plant.angles()[finger] / FINGER_SPAN)


def blocked_flexion(abduction: float) -> float:
    """Return the stop of CMC flexion, fraction of its window, at a given abduction."""
    plant = BuiltHandPlant()
    plant.drive(Channel.THUMB_ABDUCTION, towards(abduction * np.deg2rad(100.0)))
    settle(plant)
    plant.drive(Channel.THUMB_CMC_FLEXION, towards(CMC_SPAN, limit=BLOCKED))
    settle(plant)
    return float(plant.angles()[Channel.THUMB_CMC_FLEXION] / CMC_SPAN)


def blocked_flexor() -> float:
    """Return the stop of the flexor without abduction, fraction of its window."""
    plant = BuiltHandPlant()
    low, high = FLEXOR_ENDS
    plant.drive(Channel.THUMB_FLEXOR, towards(high, limit=BLOCKED))
    settle(plant)
    return float((plant.angles()[Channel.THUMB_FLEXOR] - low) / (high - low))


def closing_errors(fractions: tuple[float, ...]) -> list[float]:
    """Return the static error of the index at a sequence of positions (fractions of its window), counts."""
    plant = BuiltHandPlant()
    errors = []
    for fraction in fractions:
        plant.drive(0, towards(fraction * FINGER_SPAN))
        settle(plant, 0.4)
        errors.append(float((fraction * FINGER_SPAN - plant.angles()[0]) / COUNT))
    return errors


def opening_seconds(released: Drive) -> float:
    """Return the opening time of four closed fingers after release, s, in steps of 10 ms; inf above 2 s."""
    plant = BuiltHandPlant()
    for finger in FINGERS:
        plant.drive(finger, towards(FINGER_SPAN))
    settle(plant)
    assert plant.joint_angles()[Joint.MIDDLE_DIP] > 1.2
    for finger in FINGERS:
        plant.drive(finger, released)
    for step in range(200):
        if np.abs(plant.joint_angles()[: Joint.THUMB_ABDUCTION]).max() < OPEN_RAD:
            return 0.01 * step
        settle(plant, 0.01)
    return float("inf")


def tension_at_stall(channel: Channel) -> float:
    """Return a cable's tension at slowly reached stall torque, N, reduced by friction."""
    plant = BuiltHandPlant()
    plant.drive(Channel.THUMB_ABDUCTION, towards(1.7))
    for torque in np.linspace(0.1, STALL, 50):
        plant.drive(channel, push(torque))
        settle(plant, 0.05)
    return float(plant.cable_tensions()[channel])


def tension_after_impact(channel: Channel) -> float:
    """Return a cable's tension after its spool ran into the stop at full effort, N, maintained by friction."""
    plant = BuiltHandPlant()
    plant.drive(Channel.THUMB_ABDUCTION, towards(1.7))
    plant.drive(channel, push(STALL))
    settle(plant)
    return float(plant.cable_tensions()[channel])


def step_rise() -> tuple[float, float]:
    """Return rise (10-90 %, s, in steps of 5 ms) and overshoot (fraction of the step) of 164 counts on the index."""
    plant = BuiltHandPlant()
    plant.drive(0, towards(1.5))
    settle(plant)
    start = plant.angles()[0]
    plant.drive(0, towards(1.5 + 164 * COUNT))
    trace = []
    for _ in range(40):
        plant.advance_to(plant.time + 0.005)
        trace.append((plant.angles()[0] - start) / (164 * COUNT))
    found = np.array(trace)
    rise = 0.005 * (np.argmax(found > 0.9 * found[-1]) - np.argmax(found > 0.1 * found[-1]))
    return float(rise), float(found.max() - found[-1])


def fingertip_force(digit: str, actuator: str = "") -> float:
    """Press an extended digit's pad against a fixed block; return the contact force, N.

    Args:
        digit: a finger's label, or `thumb`.
        actuator: label of the channel that presses, its servo at stall; the finger's own if empty.
    """
    model = build_built().compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    pad = model.geom(f"{digit}_distal_box0")
    orientation = data.geom_xmat[pad.id].reshape(3, 3)
    palmar, distal = -orientation[:, 1], orientation[:, 2]
    block_half = 0.005
    surface = data.geom_xpos[pad.id] + 0.007 * distal + (pad.size[1] + block_half + 2e-4) * palmar

    spec = build_built()
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, orientation.ravel())
    spec.worldbody.add_geom(
        name="block", type=mujoco.mjtGeom.mjGEOM_BOX, size=(0.01, block_half, 0.003), pos=surface, quat=quat
    )
    model = spec.compile()
    data = mujoco.MjData(model)
    for effort in np.linspace(0.0, STALL, 40):
        data.actuator(actuator or digit).ctrl = effort
        mujoco.mj_step(model, data, 25)
    force = np.zeros(6)
    total = np.zeros(3)
    for index, contact in enumerate(data.contact):
        if model.geom("block").id in contact.geom:
            mujoco.mj_contactForce(model, data, index, force)
            total += contact.frame.reshape(3, 3).T @ force[:3]
    return float(np.linalg.norm(total))
