"""From reset to the main loop: boot text, presence check, tasks."""

from __future__ import annotations

from typing import Literal

from firmware_emulator.firmware.board import Board
from firmware_emulator.firmware.hands import SERVOS
from firmware_emulator.firmware.opcodes import HANDLERS
from firmware_emulator.firmware.telemetry import telemetry_task
from firmware_emulator.kernel import Task

ResetCause = Literal["power_on", "reset"]

USB_START_S = 0.1
PING_HEADER = "\n[Init] Pinging servos...\r\n"
SKIPPING = "[BOOT] Non-power reset \u2192 skipping homing\r\n"


def run(board: Board, cause: ResetCause) -> Task:
    """Boot, start the telemetry task and stay in the main loop."""
    profile = board.profile
    yield USB_START_S
    if profile.hand_line:
        _print(board, f"[BOOT] Hand Type: {board.hand.label}\r\n")
    if profile.reset_cause_line and cause == "reset":
        _print(board, SKIPPING)
    if profile.pings:
        yield from _report_pings(board)
    if profile.direction_lines:
        for servo, direction in zip(SERVOS, board.hand.direction, strict=True):
            _print(board, f"Servo {servo} dir={direction}\n")
    yield from serve(board)


def serve(board: Board) -> Task:
    """Start the telemetry task and stay in the main loop."""
    board.kernel.spawn(telemetry_task(board))
    yield from board.main_loop(HANDLERS)


def _report_pings(board: Board) -> Task:
    _print(board, PING_HEADER)
    for servo in SERVOS:
        answered = yield from board.uart.ping(servo)
        _print(board, f"  ID {servo}: {'OK' if answered else 'NO REPLY'}\r\n")


def _print(board: Board, text: str) -> None:
    board.transmit(text.encode())
