"""The telemetry task: one sync read of all servos a period, all or nothing."""

from __future__ import annotations

from struct import Struct

from firmware_emulator.firmware.board import Board, Telemetry
from firmware_emulator.firmware.hands import SERVOS
from firmware_emulator.firmware.mapping import to_host
from firmware_emulator.kernel import Task
from firmware_emulator.servo.registers import FEEDBACK, FEEDBACK_SIZE

_BLOCK = Struct("<HH3xB5xH")
"""Position, speed, temperature and current in the feedback block."""


def telemetry_task(board: Board) -> Task:
    """Refresh the cache every period; one in which the bus is taken, or any answer fails, leaves the old values."""
    kernel = board.kernel
    wake = kernel.now
    while True:
        wake += board.profile.telemetry_period_s
        yield max(0.0, wake - kernel.now)
        if not board.lock.try_take():
            continue
        blocks = yield from board.uart.sync_read(FEEDBACK, FEEDBACK_SIZE, SERVOS)
        board.lock.give()
        if blocks is None:
            continue
        positions, speeds, temperatures, currents = zip(*map(_BLOCK.unpack, blocks), strict=True)
        board.telemetry = Telemetry(
            list(map(to_host, positions, board.window.extend, board.window.grasp)),
            list(map(_signed, speeds)),
            list(map(_signed, currents)),
            temperatures,
        )


def _signed(word: int) -> int:
    """Value of a sign-magnitude register word."""
    return word if word < 0x8000 else 0x8000 - word
