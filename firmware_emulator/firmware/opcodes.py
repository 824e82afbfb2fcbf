"""What the firmware does with each opcode, as a table of tasks."""

from __future__ import annotations

from collections.abc import Callable
from struct import Struct

from firmware_emulator.firmware.board import POSITION, Board
from firmware_emulator.firmware.frames import CHANNELS, Opcode, reply
from firmware_emulator.firmware.hands import SERVOS
from firmware_emulator.firmware.mapping import to_counts
from firmware_emulator.kernel import Task

Handler = Callable[[Board, tuple[int, ...]], Task]

GOAL_BLOCK = Struct("<BHHH")
"""Registers 41 to 47: acceleration, goal position, goal torque, goal speed."""
GOAL_ADDRESS = 41
MAX_SPEED = 32766
MAX_TORQUE = 1023
NO_CHANNEL = (0xFFFF, 0)
"""Acknowledgement of a setting for a channel that does not exist."""


def ctrl_pos(board: Board, words: tuple[int, ...]) -> Task:
    """Send all seven goals in one sync write; nothing is acknowledged."""
    window = board.window
    rows = []
    for servo, word in zip(SERVOS, words, strict=True):
        goal = to_counts(word, window.extend[servo], window.grasp[servo])
        torque = board.torque_cap(servo, board.torque[servo])
        rows.append((servo, GOAL_BLOCK.pack(board.profile.acceleration, goal, torque, board.speed[servo])))
    yield from board.lock.take()
    yield from board.enter_mode(POSITION, 0)
    board.uart.sync_write(GOAL_ADDRESS, rows)
    board.lock.give()


def _getter(opcode: Opcode, field: str) -> Handler:
    def get(board: Board, _words: tuple[int, ...]) -> Task:
        board.transmit(reply(opcode, getattr(board.telemetry, field)))
        yield from ()

    return get


def _setter(opcode: Opcode, field: str, maximum: int) -> Handler:
    def put(board: Board, words: tuple[int, ...]) -> Task:
        channel, value = words[0], min(words[1], maximum)
        if channel < CHANNELS:
            getattr(board, field)[channel] = value
        board.transmit(reply(opcode, (channel, value) if channel < CHANNELS else NO_CHANNEL))
        yield from ()

    return put


HANDLERS: dict[int, Handler] = {
    Opcode.CTRL_POS: ctrl_pos,
    Opcode.GET_POS: _getter(Opcode.GET_POS, "positions"),
    Opcode.GET_VEL: _getter(Opcode.GET_VEL, "speeds"),
    Opcode.GET_CURR: _getter(Opcode.GET_CURR, "currents"),
    Opcode.GET_TEMP: _getter(Opcode.GET_TEMP, "temperatures"),
    Opcode.SET_SPE: _setter(Opcode.SET_SPE, "speed", MAX_SPEED),
    Opcode.SET_TOR: _setter(Opcode.SET_TOR, "torque", MAX_TORQUE),
}
