"""`setup()` and `loop()` of the sketch: ROM and boot text, homing at boot, telemetry task, dispatch of opcodes."""

from typing import Literal

from firmware_emulator.firmware.board import Board, Telemetry
from firmware_emulator.firmware.frames import words_of
from firmware_emulator.firmware.hands import SERVOS
from firmware_emulator.firmware.homing import assume_homed, home
from firmware_emulator.firmware.opcodes import HANDLERS
from firmware_emulator.firmware.profiles import BootHoming
from firmware_emulator.firmware.torque_mode import look_at_soft_limit, make_up_for_looks, next_look
from firmware_emulator.kernel import TASK_YIELD, Task, milliseconds, ticks_later
from firmware_emulator.servo.model_file import FEEDBACK, FEEDBACK_SIZE

ResetCause = Literal["power_on", "brown_out", "reset"]
"""Cause of a board's start: power-on, a dip of the supply, or any other reset (button, USB, software)."""

USB_START_MS = 100
PING_HEADER = "\n[Init] Pinging servos...\r\n"
AUTO_HOMING = "[BOOT] Auto Homing\u2026\r\n"
HOMING_COMPLETE = "[BOOT] Homing Complete\r\n"
POWERED_ON = "[BOOT] Power-on detected \u2192 homing\r\n"
SKIPPING = "[BOOT] Non-power reset \u2192 skipping homing\r\n"

# Text of the chip's ROM before the firmware's, visible on connections that survive the reset. Source: public logs of
# ESP32-S3 boards with ESP-IDF 5.5 (rbouteiller/airplay-esp32#18, espressif/esp-idf#12051,
# s60sc/ESP32-CAM_MJPEG2SD#432). The text of the hand was never recorded: addresses and lengths are from these logs.
_ROM_REASONS: dict[ResetCause, str] = {
    "power_on": "rst:0x1 (POWERON)",
    "brown_out": "rst:0xf (BROWNOUT_RST)",
    "reset": "rst:0x15 (USB_UART_CHIP_RESET)",
}
_HEAD = "ESP-ROM:esp32s3-20210327\r\nBuild:Mar 27 2021\r\n"
_LOADING = (
    "SPIWP:0xee\r\nmode:DIO, clock div:1\r\nload:0x3fce2820,len:0x159c\r\nload:0x403c8700,len:0xd24\r\n"
    "load:0x403cb700,len:0x2f48\r\nentry 0x403c891c\r\n"
)


def rom_text(cause: ResetCause, *, download: bool = False) -> str:
    """Return the ROM text of a reset, or with `download` of a reset into download mode."""
    if download:
        waiting = "boot:0x23 (DOWNLOAD(USB/UART0))\r\nSaved PC:0x40041a76\r\nwaiting for download\r\n"
        return f"{_HEAD}{_ROM_REASONS[cause]},{waiting}"
    saved = "Saved PC:0x403cf2cb\r\n" if cause == "reset" else ""
    return f"{_HEAD}{_ROM_REASONS[cause]},boot:0x2b (SPI_FAST_FLASH_BOOT)\r\n{saved}{_LOADING}"


def run(board: Board, cause: ResetCause) -> Task:
    """Boot, start the telemetry task and run the main loop."""
    yield from _setup(board, cause)
    yield from _serve(board)


def resume(board: Board) -> Task:
    """Start in the state of a board that has already booted and homed."""
    yield from assume_homed(board)
    yield from _serve(board)


def _setup(board: Board, cause: ResetCause) -> Task:
    """Print the boot text and home, depending on the version."""
    profile = board.profile
    yield from _pause(board, USB_START_MS)
    yield from _pause(board, profile.setup_pause_ms)
    if profile.hand_line:
        _print(board, f"[BOOT] Hand Type: {board.config.label}\r\n")
    yield from _home_on_boot(board, cause)
    if profile.pings:
        yield from _report_pings(board)
    if profile.direction_lines:
        for servo, direction in zip(SERVOS, board.config.direction, strict=True):
            _print(board, f"Servo {servo} dir={direction}\n")


def _serve(board: Board) -> Task:
    """Start the telemetry task and run the main loop."""
    board.start(_telemetry(board))
    yield from _loop(board)


def _telemetry(board: Board) -> Task:
    """Read all servos every period; keep the old values if the bus is taken or any answer fails."""
    kernel = board.kernel
    wake_ms = milliseconds(kernel.now)
    while True:
        if board.lock.try_take():
            blocks = yield from board.uart.sync_read(FEEDBACK, FEEDBACK_SIZE, SERVOS)
            if blocks is not None:
                board.telemetry = Telemetry(blocks, tuple(board.window.extend), tuple(board.window.grasp))
            # Tasks waiting for the lock run after this one, so they use the new reading.
            board.lock.give()
        wake_ms += board.profile.telemetry_period_ms
        if wake_ms > milliseconds(kernel.now):
            yield wake_ms / 1000.0
            # Bytes that arrive on a tick are received before the tick's task runs.
            yield TASK_YIELD


def _loop(board: Board) -> Task:
    """Process one host frame per pass, forever; a slow opcode (homing) delays all later frames."""
    yield from look_at_soft_limit(board)
    while True:
        frame = board.next_frame()
        if frame is None:
            due = next_look(board)
            yield (board.queued, due) if due is not None else board.queued
            # Bytes of this instant are received first; then the chip runs tasks due at this tick before a polling loop.
            yield TASK_YIELD
            yield TASK_YIELD
            make_up_for_looks(board)
            frame = board.next_frame()
        if frame is not None and frame[0] in board.profile.opcodes:
            yield from HANDLERS[frame[0]](board, words_of(frame))
        yield from look_at_soft_limit(board)


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
