"""Emulated hand: a plant, seven servos on a bus, and the board, on one clock."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal, get_args

from firmware_emulator.firmware import setup_and_loop
from firmware_emulator.firmware.board import Board
from firmware_emulator.firmware.frames import to_word
from firmware_emulator.firmware.hands import EXTEND_ANGLE_DEG, HANDS, SERVOS, SHAFT_OF_SERVO, Side
from firmware_emulator.firmware.nvs import Nvs
from firmware_emulator.firmware.profiles import DEFAULT_VERSION, profile_of
from firmware_emulator.firmware.setup_and_loop import rom_text
from firmware_emulator.native.program_board import ProgramBoard
from firmware_emulator.plant import Plant
from firmware_emulator.servo import control
from firmware_emulator.servo.frame import Mounting
from firmware_emulator.servo.parameters import COUNTS_PER_TURN, HLS3606M, ServoParameters
from firmware_emulator.servo_chain import MountedServo, ServoChain
from firmware_emulator.uart_master import UartMaster

Start = Literal["homed", "power_on", "reset", "bare"]

TRANSMIT_RING = 256
"""Size of the transmit ring, bytes; keeps the most recent bytes for a host that does not read."""
TRANSMIT_FIFO = 64
"""Size of the USB hardware FIFO, bytes; keeps the first unread bytes. Source: arduino-esp32 HWCDC."""
SETTLE_S = 1.0
"""Settling time after homing, before the first command to a hand that starts homed, s."""


def ideal_zeros(side: Side) -> tuple[float, ...]:
    """Return the encoder readings of an ideal homed hand at shaft angle zero, (7,) counts by servo ID."""
    config = HANDS[side]
    return tuple(
        extend - math.copysign(COUNTS_PER_TURN / 360.0, grasp - extend) * angle_deg
        for extend, grasp, angle_deg in zip(config.extend, config.grasp, EXTEND_ANGLE_DEG, strict=True)
    )


class EmulatedHand:
    """Byte-level interface of the emulated hand on a virtual clock; `links` connects hosts to it."""

    def __init__(
        self,
        plant: Plant,
        *,
        firmware: str = DEFAULT_VERSION,
        side: Side = "right",
        servos: ServoParameters = HLS3606M,
        seed: int = 0,
        start: Start = "homed",
        nvs: Nvs | None = None,
        encoder_zeros: Sequence[float] | None = None,
        host_latency_s: float = 0.0002,
        program: Path | None = None,
    ) -> None:
        """Connect the electronics to a plant at time zero.

        Args:
            plant: mechanics driven by the servos.
            firmware: a version of `firmware.profiles`.
            side: side for which the firmware was built.
            servos: parameters of all seven servos.
            seed: seed of all noise.
            start: `homed` is a hand in use: homed one second ago, energised, at rest, without boot text (a program
                boots and homes first). `power_on` and `reset` begin with the boot. `bare` leaves the board off, so that
                a physical board can drive the servos' bus.
            nvs: stored calibration; an empty one in memory when None.
            encoder_zeros: encoder readings at shaft angle zero, (7,) counts by servo ID; `ideal_zeros`
                when None.
            host_latency_s: delay between a host write and its arrival at the firmware, s (assumption).
            program: executable of `aero-hil firmware build`, run instead of the emulated firmware; `firmware` and
                `side` then name the source of the build.

        Raises:
            ValueError: an unknown firmware, side or start, or a wrong number of encoder zeros.
            FirmwareProgramError: the program does not start or does not home.
        """
        if side not in HANDS:
            raise ValueError(f"side must be one of {', '.join(HANDS)}, got {side!r}")
        if start not in get_args(Start):
            raise ValueError(f"start must be one of {', '.join(get_args(Start))}, got {start!r}")
        zeros = ideal_zeros(side) if encoder_zeros is None else tuple(encoder_zeros)
        if len(zeros) != len(SERVOS):
            raise ValueError(f"encoder_zeros needs {len(SERVOS)} values in wire order, got {len(zeros)}")
        config = HANDS[side]
        directions = [1 if config.grasp[servo] > config.extend[servo] else -1 for servo in SERVOS]
        self.chain = ServoChain(
            plant,
            [
                MountedServo(servo, Mounting(SHAFT_OF_SERVO[servo], directions[servo], zeros[servo]), servos)
                for servo in SERVOS
            ],
            seed=seed,
        )
        self.kernel, self.clock = self.chain.kernel, self.chain.clock
        self.servos, self.bus = self.chain.servos, self.chain.bus
        self.on_transmit: Callable[[bytes], None] = self.keep
        self.on_reset: Callable[[setup_and_loop.ResetCause], None] = lambda _cause: None
        """Called before every restart of the board."""
        self.says_rom_text = False
        """Whether a restart sends the ROM boot text before the text of the firmware."""
        self._unread = bytearray()
        self._profile = profile_of(firmware)
        self._config = config
        self._nvs = nvs if nvs is not None else Nvs()
        self.host_latency_s = host_latency_s
        """Delay between a host write and its arrival at the firmware, s."""
        self._program = program
        self.board = self._new_board()
        if start == "homed":
            if isinstance(self.board, ProgramBoard):
                self.board.boot_and_home()
            else:
                self.board.start(setup_and_loop.resume(self.board))
            self.clock.sleep_until(self.kernel.now + SETTLE_S)
        elif start != "bare":
            self.reset(start)

    def reset(self, cause: setup_and_loop.ResetCause = "reset", *, download: bool = False) -> None:
        """Restart the board now; `power_on` also cycles the servos' power, which clears their RAM and turn counts.

        With `download` the chip stays in download mode until the next restart.
        """
        if cause == "power_on":
            for servo in self.servos:
                servo.power_up()
        self.board.stop()
        self.on_reset(cause)
        if self.says_rom_text:
            self._transmit(rom_text(cause, download=download).encode())
        if download:
            return
        self.board = self._new_board()
        if isinstance(self.board, ProgramBoard):
            self.board.boot(cause)
        else:
            self.board.start(setup_and_loop.run(self.board, cause))

    def flash(self, firmware: str, side: Side) -> None:
        """Replace the emulated firmware version and its side, and restart the board."""
        self._profile, self._config = profile_of(firmware), HANDS[side]
        self.reset()

    def supply(self, volts: float) -> None:
        """Set the supply voltage (V) that the servos measure; the effect on the motors is up to the plant."""
        self.chain.supply(volts)

    def close(self) -> None:
        """Switch the board off and, if it runs a program, end the child process."""
        self.board.stop()

    def receive(self, data: bytes) -> None:
        """Receive bytes from the host now."""
        self.board.receive(data)

    def take_output(self) -> bytes:
        """Return and clear the bytes buffered while no host was reading."""
        unread = bytes(self._unread)
        self._unread.clear()
        return unread

    def commanded_words(self) -> list[int]:
        """Return the goals as host words, by servo ID; with torque off, the present position instead."""
        window = self.board.window if isinstance(self.board, Board) else self._config
        words = [0] * len(SERVOS)
        for servo in self.servos:
            if (at := servo.memory.get("id")) < len(words):
                held = servo.memory.get("torque_enable") == control.ON
                counts = servo.memory.get("goal_position" if held else "present_position")
                words[at] = to_word(counts, window.extend[at], window.grasp[at])
        return words

    def advance_plant(self) -> None:
        """Advance the plant to the present, before reading the plant directly."""
        self.chain.shafts.advance()

    def _new_board(self) -> Board | ProgramBoard:
        if self._program is not None:
            return ProgramBoard(
                self.kernel,
                self.bus,
                program=self._program,
                nvs=self._nvs,
                transmit=self._transmit,
                host_latency_s=self.host_latency_s,
            )
        return Board(
            self.kernel,
            UartMaster(self.bus),
            profile=self._profile,
            config=self._config,
            nvs=self._nvs,
            transmit=self._transmit,
            host_latency_s=self.host_latency_s,
        )

    def _transmit(self, data: bytes) -> None:
        self.on_transmit(data)

    def keep(self, data: bytes) -> None:
        """Buffer bytes for a host that is not reading."""
        self._unread += data
        del self._unread[TRANSMIT_FIFO : max(TRANSMIT_FIFO, len(self._unread) - TRANSMIT_RING)]
