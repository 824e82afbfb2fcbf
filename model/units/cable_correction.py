"""What one hand must be commanded differently, so that its joints stand where the actuation map believes them.

A cable that is too long or too short moves the joints behind a shaft that reads as it should; no encoder can tell. A
unit file knows it (`aero-hil calibrate` fits one to a hand's own recordings), so the emulated twin of a hand is sent to
a posture, and its cables are corrected by what its joints lack there. How the joints of a finger share its cable stays
as it is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from aero.actuation import ActuationMap
from aero.channels import Channel, Joint
from aero.policy.settings import Settings
from firmware_emulator.plant import Drive
from model import BuiltHandPlant
from model.parameters import BuiltHandParameters
from model.units import Unit, load_unit

Floats = NDArray[np.float64]

ROUNDS = 6
"""Corrections of a correction; stops and friction leave no more to gain then."""
APPROACH_S, REST_S = 0.6, 0.3
"""How the twin goes to the posture."""
STEPS = 30
STRENGTH_N_M = 0.5
"""Torque that the twin's shafts are held with, N m: enough that they arrive."""
STIFFNESS, DAMPING = 20.0, 0.1
"""How they are held, N m/rad and N m s/rad: five times a servo, so that friction leaves them where they were sent."""


def correction(unit: Unit, settings: Settings) -> Floats:
    """Return by how much longer each channel of `unit` must be commanded, (7,), m, abduction rad.

    Measured at the nominal posture of `settings`, against the unit `ideal`, which is what the map describes.
    """
    codec = ActuationMap()
    nominal = np.array(settings.nominal)
    wanted = _joints(codec, load_unit("ideal").hand, nominal)
    total = np.zeros(len(Channel))
    for _ in range(ROUNDS):
        lacking = _joints(codec, unit.hand, nominal + total) - wanted
        lacking[Joint.THUMB_ABDUCTION] = 0.0  # its shaft is the joint itself
        total += codec.travel_from_joints(lacking)
    return total


def _joints(codec: ActuationMap, hand: BuiltHandParameters, lengths: Floats) -> Floats:
    """Return the joint angles, (16,), of a hand whose shafts stand at `lengths`."""
    angles = codec.angles_from_travel(codec.travel_from_lengths(lengths))
    plant = BuiltHandPlant(replace(hand, contacts=False))
    for step in range(1, STEPS + 1):
        for channel in Channel:
            setpoint = float(angles[channel]) * step / STEPS
            plant.drive(channel, Drive(setpoint, stiffness=STIFFNESS, damping=DAMPING, limit=STRENGTH_N_M))
        plant.advance_to(APPROACH_S * step / STEPS)
    plant.advance_to(APPROACH_S + REST_S)
    return plant.joint_angles()
