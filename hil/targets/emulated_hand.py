"""An emulated hand put together: a unit's mechanics behind the electronics of one firmware."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Literal

from aero.transport import Transport
from firmware_emulator.firmware.nvs import Nvs
from firmware_emulator.hand import EmulatedHand, Start
from firmware_emulator.links.in_process import InProcessLink
from firmware_emulator.plant import Plant
from hil.faults.faulty_hand import FaultyHand, build_faulty
from hil.faults.host import HeldUp, Unplugged
from hil.faults.schedule import Schedule
from model import BuiltHandPlant
from model.cube_plant import CubePlant
from model.scene import Cube
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
    schedule: Schedule | None = None,
    cube: Cube | None = None,
) -> tuple[EmulatedHand, BuiltHandPlant]:
    """Return the electronics of an emulated hand, and the mechanics behind them.

    `start`, `nvs` and `program` are `EmulatedHand`'s; `rewire` puts something between the two; the
    faults of `schedule` are put in at their places and times. A `cube` makes the mechanics a `CubePlant`.

    Raises:
        ValueError: an unknown firmware or side; a fault that this hand cannot have; faults together with a cube.
        FirmwareProgramError: the program does not run, or does not home.
    """
    if schedule is not None and schedule.faults:
        if cube is not None:
            raise ValueError("a hand with faults holds no cube; give one of the two")
        how: dict[str, Any] = {"firmware": firmware, "hand": hand, "seed": seed, "start": start}
        return build_faulty(unit, schedule, **how, nvs=nvs, rewire=rewire, program=program)
    plant = BuiltHandPlant(unit.hand, hand) if cube is None else CubePlant(unit.hand, hand, cube)
    behind: Any = plant if rewire is None else rewire(plant)
    electronics = EmulatedHand(
        behind, firmware=firmware, hand=hand, servos=unit.servos, seed=seed, start=start, nvs=nvs, program=program
    )
    return electronics, plant


def host_link(electronics: EmulatedHand, schedule: Schedule) -> Transport:
    """Return the driver's end of the link to a hand in this process, with the faults of that end."""
    link: Transport = InProcessLink(electronics)
    clock = electronics.clock
    if isinstance(electronics, FaultyHand) and (faults := electronics.link_faults) is not None:
        link = Unplugged(link, lambda: faults.gone(clock.now()))
    for fault in schedule.of("host"):
        link = HeldUp(
            link,
            clock,
            stall_s=fault.severity,
            from_s=clock.now() + fault.at_s,
            random=schedule.random(fault),
            fired=partial(schedule.fire, fault),
        )
    return link
