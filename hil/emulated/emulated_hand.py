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
from hil.emulated.faults.assembly import HandAssembly
from hil.emulated.faults.fault import AssemblyStage
from hil.emulated.faults.faulty_hand import FaultyHand, refuse_in_a_program
from hil.emulated.faults.host import ProgramEnd
from hil.emulated.faults.schedule import Schedule
from hil.emulated.faults.workbench import Workbench
from hil.targets.passing import Passing
from model import BuiltHandPlant
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
) -> tuple[FaultyHand, Workbench]:
    """Return the electronics of an emulated hand with faults, and its workbench, which also has the mechanics.

    Args:
        unit: parameters of the healthy hand.
        spec: specification of the hand and its faults; with a cube, the mechanics are a `CubePlant`.
        start: state of the board, as for `EmulatedHand`.
        nvs: stored memory of the board.
        rewire: wraps the mechanics in a plant that faults do not see.

    Raises:
        ValueError: a fault cannot be injected into this hand.
        FirmwareProgramError: the program does not run, or does not home.
    """
    schedule = Schedule(spec.faults, spec.seed)
    if spec.firmware_program is not None:
        refuse_in_a_program(schedule.faults)
    side, seed = spec.side, spec.seed
    assembly = HandAssembly(unit, firmware=spec.firmware, side=side, random=schedule.random, fire=schedule.fire)
    workbench = Workbench(assembly, schedule)
    workbench.build(AssemblyStage.BUILDING)
    hand = assembly.unit.hand
    plant = BuiltHandPlant(hand, side, seed=seed) if spec.cube is None else CubePlant(hand, side, spec.cube, seed=seed)
    assembly.build_mechanics(plant, rewire)
    workbench.build(AssemblyStage.SHAFTS)
    electronics = FaultyHand(
        assembly.shafts,
        link_faults=assembly.link,
        servos=assembly.unit.servos,
        firmware=assembly.firmware,
        side=side,
        board_side=assembly.board_side,
        seed=seed,
        start=start,
        nvs=nvs,
        program=spec.firmware_program,
    )
    assembly.connect(electronics)
    workbench.build(AssemblyStage.RUNNING)
    workbench.start()
    return electronics, workbench


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
