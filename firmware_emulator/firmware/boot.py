"""From reset to the main loop: boot text, presence check, tasks."""

from __future__ import annotations

from typing import Literal

from firmware_emulator.firmware.board import Board
from firmware_emulator.firmware.hands import SERVOS
from firmware_emulator.firmware.homing import assume_homed, home
from firmware_emulator.firmware.main_loop import main_loop
from firmware_emulator.firmware.profiles import BootHoming
from firmware_emulator.firmware.telemetry import telemetry_task
from firmware_emulator.kernel import Task, ticks_later

ResetCause = Literal["power_on", "brown_out", "reset"]
"""Why a board starts: power switched on, a dip of its supply, anything else (reset button, USB, software)."""

USB_START_MS = 100
PING_HEADER = "\n[Init] Pinging servos...\r\n"
AUTO_HOMING = "[BOOT] Auto Homing\u2026\r\n"
HOMING_COMPLETE = "[BOOT] Homing Complete\r\n"
POWERED_ON = "[BOOT] Power-on detected \u2192 homing\r\n"
SKIPPING = "[BOOT] Non-power reset \u2192 skipping homing\r\n"


def run(board: Board, cause: ResetCause) -> Task:
    """Boot, start the telemetry task and stay in the main loop."""
    profile = board.profile
    yield from _pause(board, USB_START_MS)
    yield from _pause(board, profile.setup_pause_ms)
    if profile.hand_line:
        _print(board, f"[BOOT] Hand Type: {board.hand.label}\r\n")
    yield from _home_on_boot(board, cause)
    if profile.pings:
        yield from _report_pings(board)
    if profile.direction_lines:
        for servo, direction in zip(SERVOS, board.hand.direction, strict=True):
            _print(board, f"Servo {servo} dir={direction}\n")
    yield from _serve(board)


def resume(board: Board) -> Task:
    """Go on as a board that has booted and homed before."""
    yield from assume_homed(board)
    yield from _serve(board)


def _serve(board: Board) -> Task:
    """Start the telemetry task and stay in the main loop."""
    board.start(telemetry_task(board))
    yield from main_loop(board)


def _home_on_boot(board: Board, cause: ResetCause) -> Task:
    match board.profile.boot_homing:
        case BootHoming.ALWAYS:
            _print(board, AUTO_HOMING)
            yield from home(board)
            _print(board, HOMING_COMPLETE)
        case BootHoming.ON_POWER if cause != "reset":
            _print(board, POWERED_ON)
            yield from home(board)
        case BootHoming.ON_POWER:
            _print(board, SKIPPING)
        case BootHoming.NEVER:
            pass


def _report_pings(board: Board) -> Task:
    _print(board, PING_HEADER)
    for servo in SERVOS:
        answered = yield from board.uart.ping(servo)
        _print(board, f"  ID {servo}: {'OK' if answered else 'NO REPLY'}\r\n")
        yield from _pause(board, board.profile.ping_pause_ms)


def _pause(board: Board, milliseconds: int) -> Task:
    if milliseconds:
        yield ticks_later(board.kernel.now, milliseconds)


def _print(board: Board, text: str) -> None:
    board.transmit(text.encode())
