"""The emulated hand: a plant, seven servos on a bus, and the board, on one clock."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal, get_args

from firmware_emulator.firmware import setup_and_loop
from firmware_emulator.firmware.board import Board
from firmware_emulator.firmware.frames import to_word
from firmware_emulator.firmware.hands import EXTEND_ANGLE_DEG, HANDS, SERVOS, SHAFT_OF_SERVO, HandSide
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
"""What the board keeps for a host that does not read: the most recent bytes ..."""
TRANSMIT_FIFO = 64
"""... behind the first ones, which already sit in the USB hardware (arduino-esp32 HWCDC)."""
SETTLE_S = 1.0
"""Time between the end of the last homing and the first command of a hand that starts homed, s."""


def ideal_zeros(hand: HandSide) -> tuple[float, ...]:
    """Return what the encoders of a freshly homed ideal hand read at shaft angle zero, (7,) counts by servo ID."""
    config = HANDS[hand]
    return tuple(
        extend - math.copysign(COUNTS_PER_TURN / 360.0, grasp - extend) * angle_deg
        for extend, grasp, angle_deg in zip(config.extend, config.grasp, EXTEND_ANGLE_DEG, strict=True)
    )


class EmulatedHand:
    """Bytes in, bytes out, and a clock; see `links` for the ways to reach it."""

    def __init__(
        self,
        plant: Plant,
        *,
        firmware: str = DEFAULT_VERSION,
        hand: HandSide = "right",
        servos: ServoParameters = HLS3606M,
        seed: int = 0,
        start: Start = "homed",
        nvs: Nvs | None = None,
        encoder_zeros: Sequence[float] | None = None,
        host_latency_s: float = 0.0002,
        program: Path | None = None,
    ) -> None:
        """Put the electronics on a plant whose time has not begun.

        Args:
            plant: what the servos turn.
            firmware: a version of `firmware.profiles`.
            hand: which hand the firmware was built for.
            servos: the servos' physics.
            seed: of all noise.
            start: `homed` is a hand in use: homed, energised, at rest, no boot text, one second ago; a program boots
                and homes for that first. `power_on` and `reset` begin with the boot; `bare` leaves the board off, for a
                physical one on the servos' bus.
            nvs: stored calibration; an empty one in memory when None.
            encoder_zeros: encoder readings at shaft angle zero, (7,) counts by servo ID; those of an ideal homed hand
                when None.
            host_latency_s: time from a write on the host to the firmware acting on it, s (assumption).
            program: a firmware made with `aero-hil firmware build`, to run in place of the emulated one; `firmware` and
                `hand` then say what it was made from.

        Raises:
            ValueError: an unknown firmware, hand or start, or a wrong number of encoder zeros.
            FirmwareProgramError: the program does not run, or does not home.
        """
        if hand not in HANDS:
            raise ValueError(f"hand must be one of {', '.join(HANDS)}, got {hand!r}")
        if start not in get_args(Start):
            raise ValueError(f"start must be one of {', '.join(get_args(Start))}, got {start!r}")
        zeros = ideal_zeros(hand) if encoder_zeros is None else tuple(encoder_zeros)
        if len(zeros) != len(SERVOS):
            raise ValueError(f"encoder_zeros needs {len(SERVOS)} values in wire order, got {len(zeros)}")
        config = HANDS[hand]
        directions = [1 if config.grasp[servo] > config.extend[servo] else -1 for servo in SERVOS]
        self.chain = ServoChain(
            plant,
            [
                MountedServo(servo, Mounting(SHAFT_OF_SERVO[servo], directions[servo], zeros[servo]), servos)
                for servo in SERVOS
            ],
            seed=seed,
        )
        """The servos, their bus and the clock."""
        self.kernel, self.clock = self.chain.kernel, self.chain.clock
        self.servos, self.bus = self.chain.servos, self.chain.bus
        self.on_transmit: Callable[[bytes], None] = self.keep
        self.on_reset: Callable[[setup_and_loop.ResetCause], None] = lambda _cause: None
        """Called before every restart of the board."""
        self.says_rom_text = False
        """Whether the chip's ROM prints its own text at a restart, in front of the firmware's."""
        self._unread = bytearray()
        self._profile = profile_of(firmware)
        self._config = config
        self._nvs = nvs if nvs is not None else Nvs()
        self.host_latency_s = host_latency_s
        """Time from a write on the host to the firmware acting on it, s."""
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
        """Restart the board now; `power_on` takes the servos' power away too, so they forget RAM and turns.

        With `download` it waits for a firmware to be flashed, and does nothing until its next restart.
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

    def flash(self, firmware: str, hand: HandSide) -> None:
        """Put another emulated firmware on the board, made for a side, and restart it."""
        self._profile, self._config = profile_of(firmware), HANDS[hand]
        self.reset()

    def supply(self, volts: float) -> None:
        """Let the servos measure another supply (V); what it does to their motors is the plant's."""
        self.chain.supply(volts)

    def close(self) -> None:
        """Switch the board off; only one that runs a program holds resources that must be released."""
        self.board.stop()

    def receive(self, data: bytes) -> None:
        """Take bytes from the host at the present instant."""
        self.board.receive(data)

    def take_output(self) -> bytes:
        """Return what is left of what the board sent while nobody listened, and forget it."""
        unread = bytes(self._unread)
        self._unread.clear()
        return unread

    def commanded_words(self) -> list[int]:
        """Return the goal of each servo as a host word, by servo ID; the position of a servo without torque."""
        window = self.board.window if isinstance(self.board, Board) else self._config
        words = [0] * len(SERVOS)
        for servo in self.servos:
            if (at := servo.memory.get("id")) < len(words):
                held = servo.memory.get("torque_enable") == control.ON
                counts = servo.memory.get("goal_position" if held else "present_position")
                words[at] = to_word(counts, window.extend[at], window.grasp[at])
        return words

    def advance_plant(self) -> None:
        """Bring the plant up to the present, for whoever looks at it directly."""
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
            hand=self._config,
            nvs=self._nvs,
            transmit=self._transmit,
            host_latency_s=self.host_latency_s,
        )

    def _transmit(self, data: bytes) -> None:
        self.on_transmit(data)

    def keep(self, data: bytes) -> None:
        """Hold bytes for a host that does not listen."""
        self._unread += data
        del self._unread[TRANSMIT_FIFO : max(TRANSMIT_FIFO, len(self._unread) - TRANSMIT_RING)]
