"""Torque mode: CTRL_TOR, and the soft limit of later versions.

Torque always closes the hand. Positive torque pulls toward lower counts, so the sign is positive for channels with the
higher counts at the open end. The soft limit latches: it acts once when a channel leaves its window and once on its
return, so a new command outside the window applies full torque, as on the real hand. Position mode clears the latch.
"""

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
    """Close all seven channels with one torque each, without an acknowledgement."""
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
    """Return the time (s) of the next soft-limit check, or None if the soft limit is inactive."""
    watched = board.profile.soft_limit and board.mode == TORQUE
    return board.torque_mode.next_look_ms / 1000.0 if watched else None


def make_up_for_looks(board: Board) -> None:
    """Catch up on the soft-limit checks before now that were skipped in position mode."""
    state, now = board.torque_mode, board.kernel.now
    while board.profile.soft_limit and board.mode != TORQUE and state.next_look_ms / 1000.0 < now:
        state.outside[:] = [False] * CHANNELS
        state.next_look_ms += SOFT_PERIOD_MS


def look_at_soft_limit(board: Board) -> Task:
    """Reduce the torque of channels that left their window since the last check; restore channels that returned.

    Checks continue every 20 ms in position mode, where they only clear the latch.
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
        # As in the firmware, a negative position wraps into one turn, and a failed read (32769) becomes 1.
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
