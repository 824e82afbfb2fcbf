"""The board: its memory, its receive queue and its main loop.

What the lock covers: every use of the servo UART while the telemetry task exists. The task only tries it, so a long
holder (homing, SET_ID) freezes the telemetry and delays nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from firmware_emulator.firmware.frames import CHANNELS, FRAME_SIZE, words_of
from firmware_emulator.firmware.hands import SERVOS, HandConfig
from firmware_emulator.firmware.nvs import Nvs
from firmware_emulator.firmware.profiles import FirmwareProfile
from firmware_emulator.kernel import Kernel, Mutex, Signal, Task
from firmware_emulator.uart_master import UartMaster

QUEUE_SIZE = 256
"""Receive queue of the USB driver; bytes beyond it are dropped (arduino-esp32 HWCDC)."""
POSITION, TORQUE = "position", "torque"


@dataclass
class Telemetry:
    """The last complete reading of all servos, as host words by servo ID."""

    positions: Sequence[int] = (0,) * CHANNELS
    speeds: Sequence[int] = (0,) * CHANNELS
    currents: Sequence[int] = (0,) * CHANNELS
    temperatures: Sequence[int] = (0,) * CHANNELS


@dataclass
class Window:
    """Where each channel's travel begins and ends, counts by servo ID."""

    extend: list[int] = field(default_factory=list)
    grasp: list[int] = field(default_factory=list)


class Board:
    """State of a running firmware, and the loop that takes host frames one by one."""

    def __init__(
        self,
        kernel: Kernel,
        uart: UartMaster,
        *,
        profile: FirmwareProfile,
        hand: HandConfig,
        nvs: Nvs,
        transmit: Callable[[bytes], None],
        host_latency_s: float,
    ) -> None:
        """Reset the firmware: RAM at its defaults, the extend values from NVS."""
        self.kernel = kernel
        self.uart = uart
        self.profile = profile
        self.hand = hand
        self.nvs = nvs
        self.transmit = transmit
        self.lock = Mutex(kernel)
        self.window = Window(
            [nvs.extend(channel, baseline) for channel, baseline in enumerate(hand.extend)], list(hand.grasp)
        )
        self.speed = [profile.speed] * CHANNELS
        self.torque = [profile.torque] * CHANNELS
        self.mode = POSITION
        self.telemetry = Telemetry()
        self._host_latency_s = host_latency_s
        self._queue = bytearray()
        self._queued = Signal(kernel)

    def receive(self, data: bytes) -> None:
        """Queue bytes from the host, up to the size of the queue."""
        self._queue += data[: QUEUE_SIZE - len(self._queue)]
        if len(self._queue) >= FRAME_SIZE:
            self._queued.fire()

    def main_loop(self, handlers: dict[int, Callable[[Board, tuple[int, ...]], Task]]) -> Task:
        """Take frames for ever: 16 bytes at a time from wherever the queue stands, without any resynchronisation."""
        queue = self._queue
        while True:
            while len(queue) < FRAME_SIZE:
                yield self._queued
            yield self._host_latency_s
            frame = bytes(queue[:FRAME_SIZE])
            del queue[:FRAME_SIZE]
            if frame[0] in self.profile.opcodes:
                yield from handlers[frame[0]](self, words_of(frame))

    def enter_mode(self, mode: str, register_value: int) -> Task:
        """Switch all servos to a mode if the firmware believes they are in the other one; the lock is held."""
        if self.mode != mode:
            for servo in SERVOS:
                yield from self.uart.write(servo, 33, bytes((register_value,)))
            self.mode = mode

    def torque_cap(self, channel: int, torque: int) -> int:
        """Return a torque (register units) after the thermal clamp, which looks at the cached temperature only."""
        hot = self.profile.hot
        if hot is not None and self.telemetry.temperatures[channel] >= hot[0]:
            return min(torque, hot[1])
        return torque
