"""CALIBRATE_MID: the servo's present position becomes 2048, and the host is told what was read afterwards.

Nothing is stored but the servo's own offset: the window of the channel stays, so that the same command means another
angle afterwards. Source: aero-open-firmware dd91e5a.
"""

from __future__ import annotations

from firmware_emulator.firmware.board import POSITION, Board
from firmware_emulator.firmware.frames import CHANNELS, Opcode, reply
from firmware_emulator.firmware.mapping import to_host
from firmware_emulator.firmware.servo_calls import GOAL_ADDRESS, calibrate, goal, read_signed, write_register
from firmware_emulator.kernel import Task, ticks_later

UNREAD = 0xFFFF
"""Position word of an acknowledgement when a reading or a step failed."""
ACK_VERSION = 1
"""Version of the acknowledgement's format, its word 4."""
CENTRED, NOT_CENTRED = 0, 1
CENTRE = range(2000, 2097)
"""Positions, counts, that are accepted as the middle of a turn."""
SETTLE_MS = 30
COUNTS_PER_TURN = 4096


def calibrate_mid(board: Board, words: tuple[int, ...]) -> Task:
    """Centre one channel's servo where it stands; refuse an unknown channel, and torque mode, without bus traffic."""
    channel = words[0]
    position = None
    if channel < CHANNELS and board.mode == POSITION:
        yield from board.lock.take()
        position = yield from centre(board, channel)
        board.lock.give()
    if position is None:
        answer = (UNREAD, 0, NOT_CENTRED)
    else:
        counts = position % COUNTS_PER_TURN
        word = to_host(counts, board.window.extend[channel], board.window.grasp[channel])
        answer = (counts, word, CENTRED if counts in CENTRE else NOT_CENTRED)
    board.transmit(reply(Opcode.CALIBRATE_MID, (channel, *answer, ACK_VERSION)))


def centre(board: Board, channel: int) -> Task:
    """Recalibrate and hold; return the position (counts) if every step was acknowledged, else None. The lock is held.

    A negative position counts as unread, a read that failed (32769) as a position.
    """
    uart = board.uart
    calibrated = yield from calibrate(uart, channel)
    yield ticks_later(board.kernel.now, SETTLE_MS)
    position = (yield from read_signed(uart, channel, "present_position")) if calibrated else -1
    # Mode and lock are written whatever came before.
    in_mode = yield from write_register(uart, channel, "mode", 0)
    locked = yield from write_register(uart, channel, "lock", 1)
    held = position >= 0 and in_mode and locked
    if held:
        move = goal(
            position,
            speed=board.speed[channel],
            acceleration=board.profile.acceleration,
            torque=board.torque[channel],
        )
        held = yield from uart.write(channel, GOAL_ADDRESS, move)
    energised = yield from write_register(uart, channel, "torque_enable", 1)
    return position if held and energised else None
