"""An emulated hand put together: a unit's mechanics behind the electronics of one firmware."""

from __future__ import annotations

from typing import Literal

from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import InProcessLink
from hil.units import Unit
from model import BuiltHandPlant


def build_emulated(
    unit: Unit, *, firmware: str, hand: Literal["right", "left"], seed: int
) -> tuple[InProcessLink, EmulatedHand, BuiltHandPlant]:
    """Return a link to an emulated hand, its electronics and the mechanics behind them.

    Raises:
        ValueError: an unknown firmware or side.
    """
    plant = BuiltHandPlant(unit.hand, hand=hand)
    electronics = EmulatedHand(plant, firmware=firmware, hand=hand, servos=unit.servos, seed=seed)
    return InProcessLink(electronics), electronics, plant
