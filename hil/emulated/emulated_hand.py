"""Construction of an emulated hand: mechanics of a unit, electronics with one firmware, and the link to a host."""

from collections.abc import Callable
from random import Random

from aero import AeroHand
from aero.channels import Channel
from aero.clock import Clock
from aero.transport import Transport
from firmware_emulator.firmware.nvs import Nvs
from firmware_emulator.hand import Start
from firmware_emulator.links.in_process import InProcessLink
from firmware_emulator.plant import Plant
from hil.emulated.emulated_spec import EmulatedSpec
from hil.emulated.faults.faulty_hand import FaultyHand, build_faulty
from hil.emulated.faults.host import ProgramEnd
from hil.emulated.faults.schedule import Schedule
from hil.emulated.faults.workbench import Workbench
from hil.targets.passing import Passing
from model.cube_plant import CubePlant
from model.units import Unit
from model.units.conditions import Conditions

Rewire = Callable[[Plant], Plant]
"""Wraps the mechanics in a plant between servo shafts and mechanics, for example with two cables exchanged."""


def build_emulated(
    unit: Unit,
    spec: EmulatedSpec,
    *,
    start: Start = "homed",
    nvs: Nvs | None = None,
    rewire: Rewire | None = None,
    schedule: Schedule | None = None,
) -> tuple[FaultyHand, Workbench]:
    """Return the electronics of an emulated hand, and its workbench, which also has the mechanics.

    `start`, `nvs` and `rewire` are those of `build_faulty`; `schedule` lists the faults to be injected (None: none).
    With a cube in `spec`, the mechanics are a `CubePlant`.

    Raises:
        ValueError: a fault cannot be injected into this hand.
        FirmwareProgramError: the program does not run, or does not home.
    """
    cube, side = spec.cube, spec.side
    return build_faulty(
        unit,
        schedule or Schedule(seed=spec.seed),
        firmware=spec.firmware,
        side=side,
        seed=spec.seed,
        start=start,
        nvs=nvs,
        program=spec.firmware_program,
        rewire=rewire,
        mechanics=None if cube is None else lambda built: CubePlant(built.hand, side, cube, seed=spec.seed),
    )


def host_link(workbench: Workbench) -> Transport:
    """Return the driver's end of the link to a hand in this process, with its host faults."""
    electronics = workbench.electronics
    return ProgramEnd(InProcessLink(electronics), electronics.clock, workbench.assembly)


class LateHost(Passing):
    """Transport that delays every write, as a slow program does."""

    def __init__(self, behind: Transport, clock: Clock, late_s: float, random: Random) -> None:
        """Delay each write by a random 50 to 100 % of `late_s`, s."""
        super().__init__(behind)
        self._clock, self._late_s, self._random = clock, late_s, random

    def write(self, data: bytes) -> None:
        """Send all of `data`, late."""
        self._clock.sleep_until(self._clock.now() + self._random.uniform(0.5, 1.0) * self._late_s)
        super().write(data)


def with_initial_conditions(
    conditions: Conditions, link: Transport, clock: Clock, *, settable: bool, seed: int
) -> Transport:
    """Wrap the link with the host jitter of `conditions`, and write the servo limits of an earlier program.

    The hand does not move. `settable` is True if the firmware accepts limits; `seed` is that of the jitter.
    """
    earlier = AeroHand(link, clock)
    for channel in Channel if settable else ():
        if conditions.speed is not None:
            earlier.set_speed(channel, conditions.speed)
        if conditions.torque is not None:
            earlier.set_torque(channel, conditions.torque)
    return LateHost(link, clock, conditions.late_s, Random(seed)) if conditions.late_s else link
