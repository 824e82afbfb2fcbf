"""The telemetry task: one sync read of all servos a period, all or nothing."""

from __future__ import annotations

from firmware_emulator.firmware.board import Board
from firmware_emulator.firmware.hands import SERVOS
from firmware_emulator.firmware.reading import Telemetry
from firmware_emulator.kernel import BEHIND, Task, milliseconds
from firmware_emulator.servo.model_file import FEEDBACK
from firmware_emulator.servo.registers import FEEDBACK_SIZE


def telemetry_task(board: Board) -> Task:
    """Refresh the cache every period; one in which the bus is taken, or any answer fails, leaves the old values."""
    kernel = board.kernel
    wake_ms = milliseconds(kernel.now)
    while True:
        if board.lock.try_take():
            blocks = yield from board.uart.sync_read(FEEDBACK, FEEDBACK_SIZE, SERVOS)
            if blocks is not None:
                board.telemetry = Telemetry(blocks, tuple(board.window.extend), tuple(board.window.grasp))
            # Whoever waits for the lock runs after this task, so that it sees what was just read.
            board.lock.give()
        wake_ms += board.profile.telemetry_period_ms
        if wake_ms > milliseconds(kernel.now):
            yield wake_ms / 1000.0
            # What arrives on a tick is there before the tick's task runs.
            yield BEHIND
