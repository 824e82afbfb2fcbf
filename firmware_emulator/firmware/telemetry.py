"""The telemetry task: one sync read of all servos a period, all or nothing."""

from __future__ import annotations

from collections.abc import Sequence
from struct import Struct

from firmware_emulator.firmware.board import Board, Telemetry
from firmware_emulator.firmware.hands import SERVOS
from firmware_emulator.firmware.mapping import to_host
from firmware_emulator.kernel import Task, Until, milliseconds
from firmware_emulator.servo.registers import FEEDBACK, FEEDBACK_SIZE

_BLOCK = Struct("<HH3xB5xH")
"""Position, speed, temperature and current in the feedback block."""


def telemetry_task(board: Board) -> Task:
    """Refresh the cache every period; one in which the bus is taken, or any answer fails, leaves the old values."""
    kernel = board.kernel
    wake_ms = milliseconds(kernel.now)
    while True:
        if board.lock.try_take():
            blocks = yield from board.uart.sync_read(FEEDBACK, FEEDBACK_SIZE, SERVOS)
            if blocks is not None:
                board.telemetry = _decoded(board, blocks)
            # Whoever waits for the lock runs after this task, so that it sees what was just read.
            board.lock.give()
        wake_ms += board.profile.telemetry_period_ms
        if wake_ms > milliseconds(kernel.now):
            yield Until(wake_ms / 1000.0)
            # What arrives on a tick is there before the tick's task runs.
            yield 0.0


def _decoded(board: Board, blocks: Sequence[bytes]) -> Telemetry:
    positions, speeds, temperatures, currents = zip(*map(_BLOCK.unpack, blocks), strict=True)
    return Telemetry(
        list(map(to_host, positions, board.window.extend, board.window.grasp)),
        list(map(_signed, speeds)),
        list(map(_signed, currents)),
        temperatures,
    )


def _signed(word: int) -> int:
    """Value of a sign-magnitude register word."""
    return word if word < 0x8000 else 0x8000 - word
