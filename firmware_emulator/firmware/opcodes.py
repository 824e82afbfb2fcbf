"""What the firmware does with each opcode, as a table of tasks."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from firmware_emulator.firmware import homing
from firmware_emulator.firmware.board import POSITION, Board
from firmware_emulator.firmware.calibrate_mid import ACK_VERSION, COUNTS_PER_TURN, UNREAD, calibrate_mid
from firmware_emulator.firmware.frames import CHANNELS, Opcode, reply
from firmware_emulator.firmware.hands import SERVOS
from firmware_emulator.firmware.mapping import MAX_COUNTS, divide, to_counts
from firmware_emulator.firmware.servo_calls import GOAL_ADDRESS, goal, int16, read_signed
from firmware_emulator.firmware.set_id import set_id
from firmware_emulator.firmware.torque_mode import ctrl_tor
from firmware_emulator.kernel import Task

Handler = Callable[[Board, tuple[int, ...]], Task]

MAX_SPEED = 32766
MAX_TORQUE = 1023
EIGHTHS_OF_COUNTS_PER_DEGREE = 91
"""The firmware's 11.375 = 4095 / 360, exactly."""
NO_CHANNEL = (0xFFFF, 0)
"""Acknowledgement of a setting for a channel that does not exist."""


def ctrl_pos(board: Board, words: tuple[int, ...]) -> Task:
    """Send all seven goals in one sync write; nothing is acknowledged."""
    window, acceleration = board.window, board.profile.acceleration
    torques = map(board.torque_cap, SERVOS, board.torque)
    ends = zip(window.extend, window.grasp, strict=True)
    rows = [
        (servo, _move(word, between, speed, acceleration, torque))
        for servo, word, between, speed, torque in zip(SERVOS, words, ends, board.speed, torques, strict=True)
    ]
    yield from board.lock.take()
    yield from board.enter_mode(POSITION, 0)
    board.uart.sync_write(GOAL_ADDRESS, rows)
    board.lock.give()


# A stream of commands says the same of most channels again and again.
@lru_cache(maxsize=1024)
def _move(word: int, ends: tuple[int, int], speed: int, acceleration: int, torque: int) -> bytes:
    return goal(to_counts(word, *ends), speed=speed, acceleration=acceleration, torque=torque)


def home(board: Board, _words: tuple[int, ...]) -> Task:
    """Home, however long it takes, and acknowledge whatever came of it."""
    yield from homing.home(board)
    board.transmit(reply(Opcode.HOMING, ()))


def trim(board: Board, words: tuple[int, ...]) -> Task:
    """Move the open end of a channel's window by degrees and store it; for an unknown channel, nothing happens."""
    channel = words[0]
    if channel < CHANNELS:
        shift = divide(int16(words[1]) * EIGHTHS_OF_COUNTS_PER_DEGREE, 8)
        extend = min(max(board.window.extend[channel] + shift, 0), MAX_COUNTS)
        board.window.extend[channel] = extend
        board.nvs.store_extend(channel, extend)
        present = (yield from _present(board, channel)) if board.profile.trim_reads_position else ()
        board.transmit(reply(Opcode.TRIM, (channel, extend, *present)))
    yield from ()


def _present(board: Board, channel: int) -> Task:
    """Return the words that later versions add to the acknowledgement of TRIM: position, 0, its version.

    A negative position is said to be unread, and a read that failed (32769) comes out as 1.
    """
    yield from board.lock.take()
    position = yield from read_signed(board.uart, channel, "present_position")
    board.lock.give()
    return (UNREAD if position < 0 else position % COUNTS_PER_TURN, 0, ACK_VERSION)


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
    Opcode.HOMING: home,
    Opcode.SET_ID: set_id,
    Opcode.TRIM: trim,
    Opcode.CALIBRATE_MID: calibrate_mid,
    Opcode.CTRL_POS: ctrl_pos,
    Opcode.CTRL_TOR: ctrl_tor,
    Opcode.GET_POS: _getter(Opcode.GET_POS, "positions"),
    Opcode.GET_VEL: _getter(Opcode.GET_VEL, "speeds"),
    Opcode.GET_CURR: _getter(Opcode.GET_CURR, "currents"),
    Opcode.GET_TEMP: _getter(Opcode.GET_TEMP, "temperatures"),
    Opcode.SET_SPE: _setter(Opcode.SET_SPE, "speed", MAX_SPEED),
    Opcode.SET_TOR: _setter(Opcode.SET_TOR, "torque", MAX_TORQUE),
}
