"""SET_ID: find the only servo on the bus, write its current limit and change its ID.

IDs 0 to 253 are accepted. The bus lock is released between scan, check and write, so telemetry runs in between.
"""

from firmware_emulator.firmware.board import Board
from firmware_emulator.firmware.frames import Opcode, reply
from firmware_emulator.firmware.servo_calls import unlock, write_register
from firmware_emulator.kernel import Task, ticks_later
from firmware_emulator.servo.models import REGISTERS

IDS = range(254)
MAX_LIMIT = 1023


def set_id(board: Board, words: tuple[int, ...]) -> Task:
    """Set the ID and reply with old ID, new ID and the limit read back, or with error words."""
    new, limit = words[0] & 0xFF, min(words[1], MAX_LIMIT)
    if new not in IDS:
        _answer(board, 0xFF, new, 0)
        return
    found = yield from _scan(board)
    if not found:
        _answer(board, 0xFF, new, 0)
        return
    if len(found) > 1:
        _answer(board, 0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF)
        return
    (old,) = found
    if new != old and (yield from _ping(board, new)):
        _answer(board, old, new, 0)
        return
    yield from board.lock.take()
    stored = yield from _write(board, old, new, limit)
    board.lock.give()
    _answer(board, old, new, stored)


def _scan(board: Board) -> Task:
    """Return the first two IDs that answer a ping, or fewer."""
    found: list[int] = []
    yield from board.lock.take()
    for servo in IDS:
        if (yield from board.uart.ping(servo)):
            found.append(servo)
            if len(found) == 2:
                break
    board.lock.give()
    return found


def _ping(board: Board, servo: int) -> Task:
    yield from board.lock.take()
    answered = yield from board.uart.ping(servo)
    board.lock.give()
    return answered


def _write(board: Board, old: int, new: int, limit: int) -> Task:
    """Write limit and ID; return the limit read back, or 0 after a failed read."""
    uart = board.uart
    yield from unlock(uart, old)
    yield from write_register(uart, old, "protection_current", limit)
    yield from _settle(board)
    if new != old:
        yield from write_register(uart, old, "id", new)
        yield from _settle(board)
    yield from write_register(uart, new, "lock", 1)
    yield from _settle(board)
    stored = yield from uart.read(new, REGISTERS["protection_current"].address, 2)
    return 0 if stored is None else int.from_bytes(stored, "little")


def _settle(board: Board) -> Task:
    if board.profile.eeprom_pause_ms:
        yield ticks_later(board.kernel.now, board.profile.eeprom_pause_ms)


def _answer(board: Board, *words: int) -> None:
    board.transmit(reply(Opcode.SET_ID, words))
