"""What one hand must be commanded differently, so that its joints stand where the actuation map believes them.

A cable that is too long or too short moves the joints behind a shaft that reads as it should; no encoder can tell. A
unit file knows it (`aero-hil calibrate` fits one to a hand's own recordings), so the emulated twin of a hand is sent to
a posture, and its cables are corrected by what its joints lack there. How the joints of a finger share its cable stays
as it is.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import mujoco
import numpy as np
from numpy.typing import NDArray

from aero.actuation import ActuationMap
from aero.channels import Channel, Joint
from aero.policy.running import NO_CORRECTION, typical_correction
from aero.policy.settings import PolicySettings
from firmware_emulator.plant import Drive
from model.built import build_built
from model.compiled_hand import SHAFTS, CompiledHand
from model.parameters import BuiltHandParameters
from model.units import Unit, load_unit
from model.units.plausible import unit_named

Floats = NDArray[np.float64]

ROUNDS = 6
"""Corrections of a correction; stops and friction leave no more to gain then."""
APPROACH_S, REST_S = 0.6, 0.3
"""How the twin goes to the posture."""
STEPS = 30
HELD = Drive(stiffness=20.0, damping=0.1, limit=0.5)
"""How its shafts are held: five times as stiff as by a servo, so that friction leaves them where they were sent."""


TYPICAL, NONE = "typical", "none"
"""Names of the two corrections that are no hand's own."""


def named_correction(name: str, settings: PolicySettings) -> Floats:
    """Return the correction with this name, (7,), m, abduction rad: `typical`, `none`, or a unit's own.

    Args:
        name: one of the two, or a unit as `model.units.plausible.unit_named` takes it.
        settings: whose nominal grasp a unit's correction is measured at.

    Raises:
        ValueError: there is no such unit.
    """
    if name == TYPICAL:
        return np.array(typical_correction())
    if name == NONE:
        return np.array(NO_CORRECTION)
    return correction(unit_named(name), settings)


def correction(unit: Unit, settings: PolicySettings) -> Floats:
    """Return by how much longer each channel of `unit` must be commanded, (7,), m, abduction rad.

    Measured at the nominal posture of `settings`, against the unit `ideal`, which is what the map describes.

    Raises:
        ArithmeticError: the physics diverged.
    """
    codec, nominal = ActuationMap(), np.array(settings.nominal)
    wanted = _wanted(settings.nominal)
    twin, total = _twin(unit.hand), np.zeros(len(Channel))
    for _ in range(ROUNDS):
        lacking = _joints(twin, nominal + total) - wanted
        lacking[Joint.THUMB_ABDUCTION] = 0.0  # its shaft is the joint itself
        total += codec.travel_from_joints(lacking)
    return total


@lru_cache
def _wanted(nominal: tuple[float, ...]) -> Floats:
    """Return the joint angles, (16,), that the map believes in at `nominal`."""
    return _joints(_twin(load_unit("ideal").hand), np.array(nominal))


def _twin(parameters: BuiltHandParameters) -> CompiledHand:
    alone = replace(parameters, contacts=False)
    twin = CompiledHand(build_built(parameters=alone), alone)
    for shaft in range(SHAFTS):
        twin.drive(shaft, HELD)
    return twin


def _joints(twin: CompiledHand, lengths: Floats) -> Floats:
    """Return the joint angles, (16,), of a hand whose shafts go from its start to `lengths`."""
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
