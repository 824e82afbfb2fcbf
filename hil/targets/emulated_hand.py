"""An emulated hand put together: a unit's mechanics behind the electronics of one firmware."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

from firmware_emulator.firmware.nvs import Nvs
from firmware_emulator.hand import EmulatedHand, Start
from firmware_emulator.plant import Plant
from model import BuiltHandPlant
from model.units import Unit

Rewire = Callable[[Plant], Plant]
"""Puts something between the servos' shafts and the mechanics, as a builder who mixes up two cables does."""


def build_emulated(
    unit: Unit,
    *,
    firmware: str,
    hand: Literal["right", "left"],
    seed: int,
    start: Start = "homed",
    nvs: Nvs | None = None,
    rewire: Rewire | None = None,
    program: Path | None = None,
) -> tuple[EmulatedHand, BuiltHandPlant]:
    """Return the electronics of an emulated hand, and the mechanics behind them.

    `start`, `nvs` and `program` are `EmulatedHand`'s; `rewire` puts something between the two.

    Raises:
        ValueError: an unknown firmware or side.
        FirmwareProgramError: the program does not run, or does not home.
    """
    plant = BuiltHandPlant(unit.hand, hand=hand)
    behind: Any = plant if rewire is None else rewire(plant)
    electronics = EmulatedHand(
        behind, firmware=firmware, hand=hand, servos=unit.servos, seed=seed, start=start, nvs=nvs, program=program
    )
    return electronics, plant
