"""Torque mode: CTRL_TOR, and the soft limit that later versions add to it.

The sign always closes the hand: positive torque pulls toward lower counts, so it is positive where the open end has
the higher counts. The soft limit is latched: it acts once when a channel leaves its window and once when it is back,
so a new command while outside drives on at full torque, as on the real hand. Position mode opens the latch.
"""

from __future__ import annotations

from firmware_emulator.firmware.board import TORQUE, Board
from firmware_emulator.firmware.frames import CHANNELS
from firmware_emulator.firmware.hands import SERVOS
from firmware_emulator.firmware.servo_calls import read_signed, sign_magnitude, write_register
from firmware_emulator.kernel import Task, milliseconds

MAX_MAGNITUDE = 1000
SOFT_TORQUE = 200
SOFT_PERIOD_MS = 20
COUNTS_PER_TURN = 4096


def ctrl_tor(board: Board, words: tuple[int, ...]) -> Task:
    """Close all seven channels with a torque each; nothing is acknowledged."""
    profile, window, state = board.profile, board.window, board.torque_mode
    for channel, word in enumerate(words):
        magnitude = board.torque_cap(channel, max(min(word, MAX_MAGNITUDE), profile.torque_floor))
        extend, grasp = window.extend[channel], window.grasp[channel]
        sign = profile.sign_of_empty_window if extend == grasp else 1 if extend > grasp else -1
        state.commanded[channel] = sign * magnitude
    yield from board.lock.take()
    yield from board.enter_mode(TORQUE, 2)
    for channel in SERVOS:
        yield from _write_torque(board, channel, state.commanded[channel])
    board.lock.give()


def next_look(board: Board) -> float | None:
    """Return when (s) the main loop looks at the soft limit again; None when it will find nothing to do."""
    watched = board.profile.soft_limit and board.mode == TORQUE
    return board.torque_mode.next_look_ms / 1000.0 if watched else None


def make_up_for_looks(board: Board) -> None:
    """Leave the soft limit as the looks before now would have, which are not taken in position mode."""
    state, now = board.torque_mode, board.kernel.now
    while board.profile.soft_limit and board.mode != TORQUE and state.next_look_ms / 1000.0 < now:
        state.outside[:] = [False] * CHANNELS
        state.next_look_ms += SOFT_PERIOD_MS


def look_at_soft_limit(board: Board) -> Task:
    """Weaken every channel that has left its window since the last check, and restore every one that is back.

    The grid of 20 ms goes on in position mode too, where all that happens is that the latch opens.
    """
    state = board.torque_mode
    now_ms = milliseconds(board.kernel.now)
    if not board.profile.soft_limit or now_ms < state.next_look_ms:
        return
    state.next_look_ms = now_ms + SOFT_PERIOD_MS
    if board.mode != TORQUE:
        state.outside[:] = [False] * CHANNELS
        return
    yield from board.lock.take()
    for channel in SERVOS:
        position = yield from read_signed(board.uart, channel, "present_position")
        # A negative position and a failed read (32769) come out within one turn, the latter as 1.
        counts = (position + (0x8000 if position < 0 else 0)) % COUNTS_PER_TURN
        ends = board.window.extend[channel], board.window.grasp[channel]
        outside = not min(ends) <= counts <= max(ends)
        if outside != state.outside[channel]:
            state.outside[channel] = outside
            commanded = state.commanded[channel]
            soft = SOFT_TORQUE if commanded >= 0 else -SOFT_TORQUE
            yield from _write_torque(board, channel, soft if outside else commanded)
    board.lock.give()


def _write_torque(board: Board, channel: int, torque: int) -> Task:
    return write_register(board.uart, channel, "goal_torque", sign_magnitude(torque))
