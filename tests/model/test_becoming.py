"""A hand that breaks in the middle goes on from where it was."""

import dataclasses

import numpy as np
import pytest

from aero.channels import CABLES
from firmware_emulator.plant import Drive
from model import BuiltHandParameters, BuiltHandPlant

CLOSE = Drive(setpoint=2.0, stiffness=3.0, damping=0.05, limit=0.5)


def closing(become=None):
    plant = BuiltHandPlant()
    plant.drive(0, CLOSE)
    plant.advance_to(0.1)
    before = plant.angles(), plant.joint_angles()
    if become is not None:
        plant.become(become)
    assert np.array_equal(plant.angles(), before[0])
    assert np.array_equal(plant.joint_angles(), before[1])
    plant.advance_to(1.0)
    return plant


def test_becoming_the_same_hand_changes_nothing():
    assert np.array_equal(closing(BuiltHandParameters()).joint_angles(), closing().joint_angles())


def test_another_hand_goes_on_from_the_same_state():
    rubbing = dataclasses.replace(BuiltHandParameters(), spool_friction=(0.4, *[0.0] * 6))
    assert closing(rubbing).angles()[0] < closing().angles()[0] - 0.1


def test_parts_cannot_vanish():
    with pytest.raises(ValueError, match="keeps its parts"):
        BuiltHandPlant().become(dataclasses.replace(BuiltHandParameters(), contacts=False))


def test_a_spool_that_turned_on_without_its_cable_is_turned_back_when_it_is_wound_on_again():
    """Thrown back by metres of cable, the physics would fail."""
    whole = BuiltHandParameters()
    off = dataclasses.replace(whole, cable_take_up=(0.9,) * 4 + (0.0,) + (0.9,) * 2)
    plant = BuiltHandPlant()
    plant.become(off)
    for shaft in CABLES:
        plant.drive(shaft, Drive(torque=0.5, limit=0.5))
    plant.advance_to(5.0)
    away = plant.angles()
    plant.become(whole)
    plant.advance_to(5.5)
    assert away[list(CABLES)].min() > 40.0
    assert np.abs(plant.angles()).max() < 20.0
    assert plant.cable_tensions()[list(CABLES)].min() > 0.0
