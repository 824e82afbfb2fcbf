"""Faults of what servos answer on the bus; they do what they are told and control on what they measure."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from random import Random

from aero.channels import WIRE_ORDER
from firmware_emulator.kernel import Kernel
from firmware_emulator.packets import HEADER, Instruction, pack
from firmware_emulator.servo.registers import REGISTERS, decode_signed, encode_signed
from hil.faults.assembly import Begin, HandAssembly, Injector
from hil.faults.fault import ALL, SHARE, Fault, Kind

PERIOD_S = 0.1
"""Period of a servo that is silent now and then, s."""
ENOUGH = 0x7FFF
READS = (Instruction.READ, Instruction.SYNC_READ)

Spoil = Callable[["BusAnswer", float, Random], bytes]
"""What arrives of an answer, given the severity."""


class BusAnswer:
    """One servo's answer, and what was asked."""

    def __init__(self, data: bytes, address: int | None, now: float) -> None:
        self.servo, self.code, self.registers = data[2], data[4], data[5:-1]
        self.address = address
        """Address of the first register in it; None for an answer to no read."""
        self.now = now
        self.data = data

    def with_register(self, name: str, change: Callable[[int], int]) -> bytes:
        """Return the answer with another value in one register, when that is in it."""
        row = REGISTERS[name]
        at = -1 if self.address is None else row.address - self.address
        if at < 0 or at + row.size > len(self.registers):
            return self.data
        word = int.from_bytes(self.registers[at : at + row.size], "little")
        value = change(decode_signed(word, row.sign_bit) if row.sign_bit else word)
        value = (
            encode_signed(max(-ENOUGH, min(ENOUGH, value)), row.sign_bit) if row.sign_bit else max(0, min(255, value))
        )
        changed = self.registers[:at] + value.to_bytes(row.size, "little") + self.registers[at + row.size :]
        return pack(self.servo, self.code, changed)


class SpoiledAnswers:
    """What stands on the bus between servos and board: a `Tap`."""

    def __init__(self, kernel: Kernel, fired: Callable[[Fault], None]) -> None:
        self._kernel = kernel
        self._fired = fired
        self._faults: list[tuple[Fault, Random]] = []
        self._address: int | None = None

    def add(self, fault: Fault, random: Random) -> None:
        """Let one more fault act from now on."""
        self._faults.append((fault, random))

    def asked(self, data: bytes) -> None:
        """Note which register a read begins at."""
        self._address = data[5] if len(data) > 6 and data[4] in READS else None

    def answered(self, data: bytes) -> bytes:
        """Return what of a train of answers arrives."""
        return b"".join(self._passed(one) for one in _packets(data))

    def _passed(self, data: bytes) -> bytes:
        for fault, random in self._faults:
            assert fault.channel is not None
            if len(data) < 6 or data[2] != WIRE_ORDER.index(fault.channel):
                continue
            spoiled = SPOILS[fault.name](BusAnswer(data, self._address, self._kernel.now), fault.severity, random)
            if spoiled != data:
                self._fired(fault)
            data = spoiled
        return data


def _packets(train: bytes) -> Iterator[bytes]:
    """Cut a train into packets; what is none (two servos that spoke at once) comes as it is."""
    while train[:2] == HEADER and len(train) >= 4:
        size = train[3] + 4
        yield train[:size]
        train = train[size:]
    if train:
        yield train


def _silent(answer: BusAnswer, milliseconds: float, random: Random) -> bytes:
    return b"" if answer.now % PERIOD_S < milliseconds / 1000.0 else answer.data


def _damaged(answer: BusAnswer, share: float, random: Random) -> bytes:
    if random.random() >= share:
        return answer.data
    return answer.data[:-1] + bytes((answer.data[-1] ^ 0xFF,))


def _garbage(answer: BusAnswer, share: float, random: Random) -> bytes:
    if random.random() >= share:
        return answer.data
    return answer.with_register("present_position", lambda value: random.randrange(-ENOUGH, ENOUGH))


def _coarse(answer: BusAnswer, step: float, random: Random) -> bytes:
    return answer.with_register("present_position", lambda value: round(round(value / step) * step))


def _warmer(answer: BusAnswer, celsius: float, random: Random) -> bytes:
    return answer.with_register("present_temperature", lambda value: round(value + celsius))


def _current(answer: BusAnswer, factor: float, random: Random) -> bytes:
    return answer.with_register("present_current", lambda value: round(value * factor))


KINDS = (
    Kind(
        "servo_silent",
        "bus",
        ("C1", "B10"),
        "ms of every 100",
        (15, 30, 70),
        "a servo now and then does not answer",
        ALL,
        cause="answers_missing",
        bounds=(0, 100),
    ),
    Kind(
        "answers_damaged",
        "bus",
        ("C2",),
        "of answers",
        (0.05, 0.2, 0.6),
        "answers of a servo are damaged",
        ALL,
        cause="answers_missing",
        bounds=SHARE,
    ),
    Kind(
        "position_garbage",
        "servo",
        ("D8",),
        "of readings",
        (0.01, 0.05, 0.3),
        "a servo reports any position",
        ALL,
        bounds=SHARE,
    ),
    Kind(
        "position_coarse",
        "servo",
        ("D9",),
        "counts",
        (8, 16, 64),
        "a servo reports rounded positions",
        ALL,
        cause="readings_coarse",
        bounds=(1, 1024),
    ),
    Kind(
        "temperature_wrong",
        "servo",
        ("C3", "D12"),
        "°C",
        (10, 20, 40),
        "a servo reports too high a temperature",
        ALL,
        bounds=(-100, 100),
    ),
    Kind(
        "current_wrong",
        "servo",
        ("D8",),
        "factor",
        (1.3, 2, 4),
        "a servo reports a wrong current",
        ALL,
        bounds=(0, 100),
    ),
)
SPOILS: dict[str, Spoil] = {
    "servo_silent": _silent,
    "answers_damaged": _damaged,
    "position_garbage": _garbage,
    "position_coarse": _coarse,
    "temperature_wrong": _warmer,
    "current_wrong": _current,
}


def _spoil(assembly: HandAssembly, fault: Fault) -> Begin:
    def begin() -> None:
        tap = assembly.hand.bus.tap
        if not isinstance(tap, SpoiledAnswers):
            assembly.hand.bus.tap = tap = SpoiledAnswers(assembly.hand.kernel, assembly.fire)
        tap.add(fault, assembly.random(fault))

    return begin


INJECTORS: dict[str, Injector] = dict.fromkeys(SPOILS, _spoil)
