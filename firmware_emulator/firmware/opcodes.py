"""Handlers of the opcodes, as a table of tasks."""

from collections.abc import Callable
from functools import lru_cache

from firmware_emulator.firmware import homing
from firmware_emulator.firmware.board import POSITION, Board
from firmware_emulator.firmware.frames import CHANNELS, MAX_COUNTS, Opcode, divide, reply, to_counts, to_host
from firmware_emulator.firmware.hands import SERVOS
from firmware_emulator.firmware.servo_calls import GOAL_ADDRESS, calibrate, goal, int16, read_signed, write_register
from firmware_emulator.firmware.set_id import set_id
from firmware_emulator.firmware.torque_mode import ctrl_tor
from firmware_emulator.kernel import Task, ticks_later

Handler = Callable[[Board, tuple[int, ...]], Task]

MAX_SPEED = 32766
MAX_TORQUE = 1023
EIGHTHS_OF_COUNTS_PER_DEGREE = 91
"""Exact form of the firmware's factor 11.375 = 4095 / 360."""
UNREAD = 0xFFFF
"""Position word of an acknowledgement after a failed reading or step."""
ACK_VERSION = 1
"""Format version of the acknowledgement, in word 4."""
CENTRED, NOT_CENTRED = 0, 1
CENTRE = range(2000, 2097)
"""Positions accepted as the middle of a turn, counts."""
SETTLE_MS = 30
COUNTS_PER_TURN = 4096
NO_CHANNEL = (0xFFFF, 0)
"""Acknowledgement of a setting for an unknown channel."""


def ctrl_pos(board: Board, words: tuple[int, ...]) -> Task:
    """Send all seven goals in one sync write, without an acknowledgement."""
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


# Streamed commands repeat the goals of most channels.
@lru_cache(maxsize=1024)
def _move(word: int, ends: tuple[int, int], speed: int, acceleration: int, torque: int) -> bytes:
    return goal(to_counts(word, *ends), speed=speed, acceleration=acceleration, torque=torque)


def home(board: Board, _words: tuple[int, ...]) -> Task:
    """Home and acknowledge, even after a failed search."""
    yield from homing.home(board)
    board.transmit(reply(Opcode.HOMING, ()))


def trim(board: Board, words: tuple[int, ...]) -> Task:
    """Move the open end of a channel's window by degrees and store it; ignore an unknown channel."""
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
    """Return the words that later versions append to the acknowledgement of TRIM: position, 0, format version.

    A negative position is reported as unread, and a failed read (32769) as position 1, as in the firmware.
    """
    yield from board.lock.take()
    position = yield from read_signed(board.uart, channel, "present_position")
    board.lock.give()
    return (UNREAD if position < 0 else position % COUNTS_PER_TURN, 0, ACK_VERSION)


def calibrate_mid(board: Board, words: tuple[int, ...]) -> Task:
    """Make a servo's present position 2048; refuse an unknown channel, and torque mode, without bus traffic.

    Only the servo's offset changes. The channel's window does not, so an equal command means another angle afterwards.
    The acknowledgement carries the position read back. Source: aero-open-firmware dd91e5a.
    """
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
    """Calibrate and hold a servo; return its position (counts), or None after a failed step. The caller holds the lock.

    As in the firmware, a negative position counts as a failed step, but a failed read (32769) as a position.
    """
    uart = board.uart
    calibrated = yield from calibrate(uart, channel)
    yield ticks_later(board.kernel.now, SETTLE_MS)
    position = (yield from read_signed(uart, channel, "present_position")) if calibrated else -1
    # Mode and lock are written even after a failed step.
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
