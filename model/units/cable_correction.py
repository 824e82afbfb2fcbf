"""Cable-length correction of one hand's commands, so that its joints match the actuation map.

A cable-length error offsets the joints although the shaft reads correctly, so no encoder detects it. A unit file has
the cable lengths (`aero-hil calibrate` fits one to recordings). The hand's emulated twin therefore moves to a posture,
and the joint errors there give the correction. The distribution of a cable among a finger's joints is not corrected.
"""

from dataclasses import replace
from functools import lru_cache

import mujoco
import numpy as np

from aero.actuation import ActuationMap
from aero.channels import Channel, Joint
from aero.floats import Floats
from aero.policy.running import NO_CORRECTION, typical_correction
from aero.policy.settings import PolicySettings
from firmware_emulator.plant import Drive
from model.built import build_built
from model.compiled_hand import SHAFTS, CompiledHand
from model.parameters import BuiltHandParameters
from model.units import Unit, load_unit
from model.units.plausible import unit_named

ROUNDS = 6
"""Number of iterations; further ones do not reduce the error, because of stops and friction."""
APPROACH_S, REST_S = 0.6, 0.3
"""Durations of the twin's ramp to the posture and of its settling, s."""
STEPS = 30
HELD = Drive(stiffness=20.0, damping=0.1, limit=0.5)
"""Drive of the twin's shafts: five times as stiff as a servo, so that friction does not displace them."""


TYPICAL, NONE = "typical", "none"
"""Names of the corrections that are independent of a unit."""


def named_correction(name: str, settings: PolicySettings) -> Floats:
    """Return a correction by name, (7,), m, abduction rad: `typical`, `none`, or that of a unit.

    Args:
        name: `typical`, `none`, or a unit name for `model.units.plausible.unit_named`.
        settings: settings with the nominal grasp for the measurement of a unit's correction.

    Raises:
        ValueError: unknown unit.
    """
    if name == TYPICAL:
        return np.array(typical_correction())
    if name == NONE:
        return np.array(NO_CORRECTION)
    return correction(unit_named(name), settings)


def correction(unit: Unit, settings: PolicySettings) -> Floats:
    """Return the correction added to each command of `unit`, (7,), m, abduction rad.

    Measured at the nominal posture of `settings`, against the unit `ideal`, which matches the map.

    Raises:
        ArithmeticError: the physics diverged.
    """
    codec, nominal = ActuationMap(), np.array(settings.nominal)
    wanted = _wanted(settings.nominal)
    twin, total = _twin(unit.hand), np.zeros(len(Channel))
    for _ in range(ROUNDS):
        lacking = _joints(twin, nominal + total) - wanted
        lacking[Joint.THUMB_ABDUCTION] = 0.0  # abduction has no cable
        total += codec.travel_from_joints(lacking)
    return total


@lru_cache
def _wanted(nominal: tuple[float, ...]) -> Floats:
    """Return the joint angles, (16,), of the unit `ideal` at `nominal`."""
    return _joints(_twin(load_unit("ideal").hand), np.array(nominal))


def _twin(parameters: BuiltHandParameters) -> CompiledHand:
    alone = replace(parameters, contacts=False)
    twin = CompiledHand(build_built(parameters=alone), alone)
    for shaft in range(SHAFTS):
        twin.drive(shaft, HELD)
    return twin


def _joints(twin: CompiledHand, lengths: Floats) -> Floats:
    """Return the joint angles, (16,), after a ramp from the initial state to `lengths`."""
    codec, data = ActuationMap(), mujoco.MjData(twin.model)
    angles = codec.angles_from_travel(codec.travel_from_lengths(lengths))
    data.qpos[twin.joint_qpos] = twin.at_rest()[0]
    for step, span in [*((k, APPROACH_S / STEPS) for k in range(1, STEPS + 1)), (STEPS, REST_S)]:
        data.ctrl[:SHAFTS] = angles * step / STEPS
        twin.rub(twin.tensions(data))
        mujoco.mj_step(twin.model, data, round(span / twin.parameters.timestep))
    if data.warning.number.any():
        raise ArithmeticError(f"the physics of a hand failed on its way to the lengths {lengths.tolist()}")
    joints: Floats = data.qpos[twin.joint_qpos]
    return joints
