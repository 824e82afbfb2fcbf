"""State of the board: RAM and receive queue. The tasks that run on the board are in the other modules.

The lock guards every use of the servo UART while the telemetry task exists. The telemetry task skips a cycle if the
lock is taken, so a long holder (homing, SET_ID) only freezes the telemetry.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from struct import Struct

from firmware_emulator.firmware.frames import CHANNELS, FRAME_SIZE, to_host
from firmware_emulator.firmware.hands import SERVOS, HandConfig
from firmware_emulator.firmware.nvs import Nvs
from firmware_emulator.firmware.profiles import FirmwareProfile
from firmware_emulator.firmware.servo_calls import signed
from firmware_emulator.kernel import Kernel, Mutex, Runner, Signal, Task, on_grid
from firmware_emulator.uart_master import UartMaster

QUEUE_SIZE = 256
"""Receive queue of the USB driver, bytes; excess bytes are dropped. Source: arduino-esp32 HWCDC."""
POSITION, TORQUE = "position", "torque"
_BLOCK = Struct("<HH3xB5xH")
"""Layout of position, speed, temperature and current in the feedback block."""


class Window:
    """Open and closed end of each channel's travel, counts by servo ID; only the open ends are stored in NVS."""

    def __init__(self, config: HandConfig, nvs: Nvs) -> None:
        self.extend = [nvs.extend(channel, baseline) for channel, baseline in enumerate(config.extend)]
        self.grasp = list(config.grasp)

    def reset(self, config: HandConfig) -> None:
        """Restore the window that is compiled in."""
        self.extend[:] = config.extend
        self.grasp[:] = config.grasp

    def shift(self, channel: int, counts: int) -> None:
        """Move both ends of a channel's window by `counts`."""
        self.extend[channel] += counts
        self.grasp[channel] += counts


@dataclass
class TorqueState:
    """State of torque mode, by servo ID."""

    commanded: list[int] = field(default_factory=lambda: [0] * CHANNELS)
    """Signed torque of the last command, register units."""
    outside: list[bool] = field(default_factory=lambda: [False] * CHANNELS)
    """Whether the last soft-limit check found the channel outside its window."""
    next_look_ms: int = 0
    """Time of the next soft-limit check, ms."""


class Telemetry:
    """Last complete reading of all servos, as host words.

    Words are computed on access: the board reads at 100 Hz and a host requests them less often.
    """

    def __init__(self, blocks: Sequence[bytes], extend: Sequence[int], grasp: Sequence[int]) -> None:
        """Store blocks of registers 56 to 70 and copies of the window ends (counts)."""
        self._blocks, self._extend, self._grasp = blocks, extend, grasp
        self._unpacked: tuple[tuple[int, ...], ...] | None = None

    @property
    def positions(self) -> Sequence[int]:
        """Fraction of the window, 0..65535."""
        return list(map(to_host, self._registers()[0], self._extend, self._grasp))

    @property
    def speeds(self) -> Sequence[int]:
        """Signed speeds, register units."""
        return list(map(signed, self._registers()[1]))

    @property
    def currents(self) -> Sequence[int]:
        """Signed currents, register units."""
        return list(map(signed, self._registers()[3]))

    @property
    def temperatures(self) -> Sequence[int]:
        """Temperatures, °C."""
        return self._registers()[2]

    def _registers(self) -> tuple[tuple[int, ...], ...]:
        if self._unpacked is None:
            self._unpacked = tuple(zip(*map(_BLOCK.unpack, self._blocks), strict=True))
        return self._unpacked


NOTHING_READ = Telemetry((bytes(_BLOCK.size),) * CHANNELS, (0,) * CHANNELS, (0,) * CHANNELS)
"""Initial telemetry: zeros, until all servos have answered once."""


class Board:
    """State of a running firmware."""

    def __init__(
        self,
        kernel: Kernel,
        uart: UartMaster,
        *,
        profile: FirmwareProfile,
        config: HandConfig,
        nvs: Nvs,
        transmit: Callable[[bytes], None],
        host_latency_s: float,
    ) -> None:
        """Reset the firmware: RAM to defaults, extend values from NVS."""
        self.kernel = kernel
        self.uart = uart
        self.profile = profile
        self.config = config
        self.nvs = nvs
        self.transmit = transmit
        self.lock = Mutex(kernel)
        self.window = Window(config, nvs)
        self.speed = [profile.speed] * CHANNELS
        self.torque = [profile.torque] * CHANNELS
        self.mode = POSITION
        self.torque_mode = TorqueState()
        self.telemetry = NOTHING_READ
        self._host_latency_s = host_latency_s
        self._tasks: list[Runner] = []
        self._queue = bytearray()
        self.queued = Signal(kernel)

    def start(self, task: Task) -> None:
        """Start a task that runs until the board is reset."""
        self._tasks.append(self.kernel.spawn(task))

    def stop(self) -> None:
        """End all tasks, as a reset does."""
        for task in self._tasks:
            task.stop()

    def receive(self, data: bytes) -> None:
        """Receive bytes from the host; they reach the firmware after the host latency."""
        self.kernel.call_at(on_grid(self.kernel.now + self._host_latency_s), self._arrive, bytes(data))

    def _arrive(self, data: bytes) -> None:
        self._queue += data[: QUEUE_SIZE - len(self._queue)]
        if len(self._queue) >= FRAME_SIZE:
            self.queued.fire()

    def next_frame(self) -> bytes | None:
        """Remove and return the next 16 bytes, without resynchronisation, or None if fewer are queued."""
        if len(self._queue) < FRAME_SIZE:
            return None
        frame = bytes(self._queue[:FRAME_SIZE])
        del self._queue[:FRAME_SIZE]
        return frame

    def enter_mode(self, mode: str, register_value: int) -> Task:
        """Switch all servos to `mode` if the firmware assumes another one; the caller holds the lock."""
        if self.mode != mode:
            for servo in SERVOS:
                yield from self.uart.write(servo, 33, bytes((register_value,)))
            self.mode = mode

    def torque_cap(self, channel: int, torque: int) -> int:
        """Return `torque` (register units) clamped by the cached temperature of the channel."""
        hot = self.profile.hot
        if hot is not None and self.telemetry.temperatures[channel] >= hot[0]:
            return min(torque, hot[1])
        return torque
