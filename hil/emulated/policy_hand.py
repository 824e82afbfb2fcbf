"""Emulated side of `aero-hil run-policy`: the cube in the hand, and cable corrections of units."""

from hil.emulated.emulated_target import EmulatedTarget
from hil.targets.target import Target
from model.cube_plant import CubePlant, CubeWatch
from model.units.cable_correction import NONE, TYPICAL, named_correction
from simulator.scene import CUBE

__all__ = ["CUBE", "NONE", "TYPICAL", "CubeWatch", "cube_of", "named_correction"]


def cube_of(target: Target) -> CubeWatch | None:
    """Return the watch of the cube in an emulated hand in this process; None for another hand."""
    if not isinstance(target, EmulatedTarget) or target.in_process is None:
        return None
    plant = target.in_process.plant
    return CubeWatch(plant, target.seed) if isinstance(plant, CubePlant) else None
