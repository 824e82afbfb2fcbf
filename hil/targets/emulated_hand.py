"""An emulated hand put together: a unit's mechanics behind the electronics of one firmware, and its link to a host."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from random import Random
from typing import Any, Literal

from aero import AeroHand
from aero.channels import Channel
from aero.clock import Clock
from aero.transport import Transport
from firmware_emulator.firmware.nvs import Nvs
from firmware_emulator.hand import EmulatedHand, Start
from firmware_emulator.links.in_process import InProcessLink
from firmware_emulator.plant import Plant
from hil.faults.faulty_hand import FaultyHand, build_faulty
from hil.faults.host import HeldUp, Passing, Unplugged
from hil.faults.schedule import Schedule
from model import BuiltHandPlant
from model.cube_plant import CubePlant
from model.scene import Cube
from model.units import Unit
from model.units.conditions import Conditions

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
    faults of `schedule` are injected at their channels and times. A `cube` makes the mechanics a `CubePlant`.

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


class LateHost(Passing):
    """A program that comes to write later than it meant to, each time."""

    def __init__(self, behind: Transport, clock: Clock, late_s: float, random: Random) -> None:
        """Be late by half of `late_s` to all of it (s)."""
        super().__init__(behind)
        self._clock, self._late_s, self._random = clock, late_s, random

    def write(self, data: bytes) -> None:
        """Send all of `data`, late."""
        self._clock.sleep_until(self._clock.now() + self._random.uniform(0.5, 1.0) * self._late_s)
        super().write(data)


def found_as(conditions: Conditions, link: Transport, clock: Clock, *, settable: bool, seed: int) -> Transport:
    """Return the link as a program under conditions has it; limits of an earlier program are on the board then.

    Args:
        conditions: what is found.
        link: to a hand that nothing moves.
        clock: of the hand.
        settable: whether the firmware takes speed and torque limits.
        seed: of the host's lateness.
    """
    earlier = AeroHand(link, clock)
    for channel in Channel if settable else ():
        if conditions.speed is not None:
            earlier.set_speed(channel, conditions.speed)
        if conditions.torque is not None:
            earlier.set_torque(channel, conditions.torque)
    return LateHost(link, clock, conditions.late_s, Random(seed)) if conditions.late_s else link
