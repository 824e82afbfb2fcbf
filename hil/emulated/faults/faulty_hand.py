"""Emulated hand with injected faults, each on its channel and at its start time."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from firmware_emulator.firmware.board import Board
from firmware_emulator.firmware.hands import HANDS, Side
from firmware_emulator.firmware.nvs import Nvs
from firmware_emulator.hand import EmulatedHand, Start
from firmware_emulator.native.program_board import ProgramBoard
from firmware_emulator.plant import Plant
from hil.emulated.faults.assembly import HandAssembly
from hil.emulated.faults.fault import AssemblyStage, FaultLayer, Injection
from hil.emulated.faults.link_faults import LinkFaults
from hil.emulated.faults.schedule import Schedule
from hil.emulated.faults.workbench import Workbench
from hil.targets.wire_log import Direction
from model import BuiltHandPlant
from model.units import Unit


class FaultyHand(EmulatedHand):
    """Electronics with link faults and, optionally, firmware for the other side."""

    def __init__(self, plant: Plant, *, link_faults: LinkFaults, board_side: Side, side: Side, **settings: Any) -> None:
        """Connect the electronics to a plant.

        Args:
            plant: mechanics behind the servos.
            link_faults: active faults of the link.
            board_side: side of the board's firmware.
            side: side of the hand.
            settings: further arguments of `EmulatedHand`.
        """
        self.link_faults = link_faults
        self._board_side = board_side
        super().__init__(plant, side=side, **settings)
        link_faults.say = self.say

    def receive(self, data: bytes) -> None:
        """Receive bytes from the host, subject to link faults."""
        self._pass("to_hand", data, super().receive)

    def say(self, data: bytes) -> None:
        """Send bytes to the host, bypassing link faults."""
        self.on_transmit(data)

    def _transmit(self, data: bytes) -> None:
        self._pass("from_hand", data, self.say)

    def _pass(self, direction: Direction, data: bytes, arrive: Callable[[bytes], None]) -> None:
        if self.link_faults.is_idle:
            arrive(data)
            return
        for t, piece in self.link_faults.passed(direction, self.kernel.now, data):
            if t <= self.kernel.now:
                arrive(piece)
            else:
                self.kernel.call_at(t, arrive, piece)

    def flash(self, firmware: str, side: Side) -> None:
        """Flash an emulated firmware for a side on the board, and restart the board."""
        self._board_side = side
        super().flash(firmware, side)

    def _new_board(self) -> Board | ProgramBoard:
        self._config = HANDS[self._board_side]
        return super()._new_board()


def build_faulty(
    unit: Unit,
    schedule: Schedule,
    *,
    firmware: str,
    side: Side,
    seed: int,
    start: Start = "homed",
    nvs: Nvs | None = None,
    program: Path | None = None,
    rewire: Callable[[Plant], Plant] | None = None,
    mechanics: Callable[[Unit], BuiltHandPlant] | None = None,
) -> tuple[FaultyHand, Workbench]:
    """Return the electronics of an emulated hand with faults, and its workbench.

    Args:
        unit: parameters of the healthy hand.
        schedule: faults to be injected; start times count from the ready hand.
        firmware: declared version.
        side: side of the hand.
        seed: seed of the noise and of the friction of each motion.
        start: state of the board, as for `EmulatedHand`.
        nvs: stored memory of the board.
        program: firmware program on the board.
        rewire: wraps the mechanics in a plant between servos and mechanics.
        mechanics: builds the mechanics of a unit; `BuiltHandPlant` if None.

    Raises:
        ValueError: a fault cannot be injected into this hand; an unknown firmware or side.
    """
    if program is not None:
        refuse_in_a_program(schedule.faults)
    assembly = HandAssembly(unit, firmware=firmware, side=side, random=schedule.random, fire=schedule.fire)
    workbench = Workbench(assembly, schedule)
    workbench.build(AssemblyStage.BUILDING)
    plant = BuiltHandPlant(assembly.unit.hand, side, seed=seed) if mechanics is None else mechanics(assembly.unit)
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
        program=program,
    )
    assembly.connect(electronics)
    workbench.build(AssemblyStage.RUNNING)
    workbench.start()
    return electronics, workbench


def refuse_in_a_program(faults: tuple[Injection, ...]) -> None:
    """Refuse faults of the emulated firmware on a hand with a firmware program.

    Raises:
        ValueError: a fault acts in the emulated firmware or its board.
    """
    for fault in faults:
        if fault.fault.layer in (FaultLayer.FIRMWARE, FaultLayer.BOARD):
            raise ValueError(f"{fault} cannot be injected into a firmware program; leave out the program or the fault")
