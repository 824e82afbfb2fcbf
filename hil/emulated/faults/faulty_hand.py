"""Emulated hand with injected faults, each on its channel and at its start time."""

from collections.abc import Callable
from typing import Any

from firmware_emulator.firmware.board import Board
from firmware_emulator.firmware.hands import HANDS, Side
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.native.program_board import ProgramBoard
from firmware_emulator.plant import Plant
from hil.emulated.faults.fault import FaultLayer, Injection
from hil.emulated.faults.link_faults import LinkFaults
from hil.targets.wire_log import Direction


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


def refuse_in_a_program(faults: tuple[Injection, ...]) -> None:
    """Refuse faults of the emulated firmware on a hand with a firmware program.

    Raises:
        ValueError: a fault acts in the emulated firmware or its board.
    """
    for fault in faults:
        if fault.fault.layer in (FaultLayer.FIRMWARE, FaultLayer.BOARD):
            raise ValueError(f"{fault} cannot be injected into a firmware program; leave out the program or the fault")
