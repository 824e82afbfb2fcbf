"""Lets a firmware program boot and home where nothing has to be found, so that a hand can start as one in use.

A program keeps in its RAM what homing did, and nothing outside can put it there. So it homes on a bus of its own, whose
servos acknowledge everything and are always at their stop; it is then ready at the moment at which it first speaks to
its servos again, and can be put on the bus of the emulated hand.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from firmware_emulator.bus import BAUD, ServoBus
from firmware_emulator.firmware.frames import Opcode, reply
from firmware_emulator.firmware.hands import SERVOS
from firmware_emulator.firmware.nvs import Nvs
from firmware_emulator.kernel import Kernel
from firmware_emulator.native.program import READY, FirmwareProgramError, Turn
from firmware_emulator.native.program import SERVOS as SERVO_BYTES
from firmware_emulator.native.program_board import ProgramBoard
from firmware_emulator.servo.models import HLS3606M
from firmware_emulator.servo.registers import REGISTERS
from firmware_emulator.servo.servo import Servo

TURNAROUND_S = 1e-4
LONGEST_BOOT_S = 60.0
"""A boot that homes is over by then, s; the slowest known takes 43 s when nothing is found."""
LONGEST_HOMING_S = 200.0
"""So is a homing that the host asks for, s; 194 s."""
LONGEST_SILENCE_S = 0.1
"""A firmware that has not spoken to its servos for this long polls them in no fixed period, s."""
STALLED = 1000
"""Current that every threshold of homing takes for a contact, register units."""
MODEST_C = 25


@dataclass(frozen=True)
class Rehearsed:
    """A program that is ready to continue on another bus."""

    board: ProgramBoard
    turn: Turn
    """What it did at the present instant, not yet carried out."""


class _StalledServo:
    """As much of a `Servo` as the bus needs: answers everything, holds what was written, and is always at its stop."""

    model = HLS3606M
    status = 0
    response_level = 1
    silent_until = 0.0
    baud = BAUD
    secondary_id = None

    def __init__(self, number: int) -> None:
        self.id = number
        self.calibrated = False
        self._registers = bytearray(256)
        self._put("present_current", STALLED)
        self._put("present_temperature", MODEST_C)
        self._put("protection_current", 1023)

    def _put(self, register: str, value: int) -> None:
        row = REGISTERS[register]
        self.write(row.address, value.to_bytes(row.size, "little"))

    def read(self, address: int, count: int) -> bytes:
        return bytes(self._registers[address : address + count]).ljust(count, b"\0")

    def write(self, address: int, data: bytes) -> None:
        self._registers[address : address + len(data)] = data

    def calibrate(self, _position: int | None) -> None:
        self.calibrated = True


class _Stage:
    """A kernel, a bus of stalled servos and the program, up to the turn with which it continues on another bus."""

    def __init__(self, program: Path, nvs: Nvs, host_latency_s: float) -> None:
        self.kernel = Kernel()
        self.servos = [_StalledServo(number) for number in SERVOS]
        bus = ServoBus(self.kernel, cast("list[Servo]", self.servos), TURNAROUND_S)
        self.board = ProgramBoard(
            self.kernel, bus, program=program, nvs=nvs, transmit=self._hear, host_latency_s=host_latency_s
        )
        self.board.intercept = self._watch
        self.last: Turn | None = None
        self.acknowledged = False
        self.board.boot("power_on")

    @property
    def homed(self) -> bool:
        return self.acknowledged or all(servo.calibrated for servo in self.servos)

    def run(self, longest_s: float, until: Callable[[], bool]) -> bool:
        """Run until something holds or time is over; return whether it holds."""
        limit = self.kernel.now + longest_s
        while not until() and self.kernel.now < limit:
            upcoming = self.kernel.next_event()
            self.kernel.run_until(limit if upcoming is None else min(upcoming, limit))
        return until()

    def _hear(self, data: bytes) -> None:
        self.acknowledged |= data == reply(Opcode.HOMING, ())

    def _watch(self, turn: Turn) -> bool:
        """Keep the first turn in which the program, booted and homed, speaks to its servos."""
        kinds = [kind for kind, _ in turn.records]
        since = kinds.index(READY) if READY in kinds else 0 if self.board.ready else len(kinds)
        if self.homed and SERVO_BYTES in kinds[since:]:
            self.last = Turn(turn.wake_ms, turn.records[since:])
        return self.last is not None


def rehearse(program: Path, *, nvs: Nvs, host_latency_s: float) -> Rehearsed:
    """Boot a program as at power-on and home it; `nvs` gets what it stores.

    Raises:
        FirmwareProgramError: it did not boot, or neither homed at its boot nor when asked.
    """
    stage = _Stage(program, nvs, host_latency_s)
    if not stage.run(LONGEST_BOOT_S, lambda: stage.board.ready or stage.last is not None):
        raise FirmwareProgramError(f"{program.name}: setup() did not return within {LONGEST_BOOT_S:g} s")
    if not stage.homed:
        stage.board.receive(reply(Opcode.HOMING, ()))
        if not stage.run(LONGEST_HOMING_S, lambda: stage.acknowledged):
            raise FirmwareProgramError(
                f"{program.name} homes neither at power-on nor within {LONGEST_HOMING_S:g} s of HOMING (0x01); "
                'start the hand with `start="power_on"` or `"reset"` instead'
            )
    stage.run(LONGEST_SILENCE_S, lambda: stage.last is not None)
    return Rehearsed(stage.board, stage.last or Turn(-1, []))
