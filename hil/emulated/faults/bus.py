"""Bus faults: servo answers change in transit; motion and control of the servos stay healthy."""

from collections.abc import Callable, Iterator
from random import Random

from aero.channels import WIRE_ORDER
from firmware_emulator.kernel import Kernel
from firmware_emulator.packets import HEADER, Instruction, pack
from firmware_emulator.servo.memory import decode_signed, encode_signed
from firmware_emulator.servo.models import REGISTERS
from hil.emulated.faults.assembly import Active, HandAssembly
from hil.emulated.faults.fault import ALL, Fault, FaultLayer, Inject, Injection, Severity, share
from hil.verdict.part import Part

BUS = FaultLayer.BUS
PERIOD_S = 0.1
"""Period of an intermittently silent servo, s."""
ENOUGH = 0x7FFF
READS = (Instruction.READ, Instruction.SYNC_READ)

Spoil = Callable[["BusAnswer", float, Random], bytes]
"""Maps an answer, a severity and random numbers to the bytes that arrive."""


class BusAnswer:
    """Answer of one servo, with the address that was read."""

    def __init__(self, data: bytes, address: int | None, now: float) -> None:
        self.servo, self.code, self.registers = data[2], data[4], data[5:-1]
        self.address = address
        """Address of the first register in the answer; None unless it answers a read."""
        self.now = now
        self.data = data

    def with_register(self, name: str, change: Callable[[int], int]) -> bytes:
        """Return the answer with one register changed, or unchanged if it does not contain the register."""
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
    """`Tap` on the bus between servos and board that changes answers."""

    def __init__(self, kernel: Kernel, fired: Callable[[Injection], None]) -> None:
        self._kernel = kernel
        self._fired = fired
        self._faults: list[tuple[Injection, Spoil, Random]] = []
        self._address: int | None = None

    def add(self, fault: Injection, spoil: Spoil, random: Random) -> None:
        """Activate a fault."""
        self._faults.append((fault, spoil, random))

    def remove(self, fault: Injection) -> None:
        """Deactivate a fault."""
        self._faults = [row for row in self._faults if row[0] != fault]

    def asked(self, data: bytes) -> None:
        """Record the start address of a read."""
        self._address = data[5] if len(data) > 6 and data[4] in READS else None

    def answered(self, data: bytes) -> bytes:
        """Return the bytes that arrive of a train of answers."""
        return b"".join(self._passed(one) for one in _packets(data))

    def _passed(self, data: bytes) -> bytes:
        for fault, spoil, random in self._faults:
            if len(data) < 6 or data[2] != WIRE_ORDER.index(fault.where):
                continue
            spoiled = spoil(BusAnswer(data, self._address, self._kernel.now), fault.severity, random)
            if spoiled != data:
                self._fired(fault)
            data = spoiled
        return data


def _packets(train: bytes) -> Iterator[bytes]:
    """Split a train into packets; yield a malformed rest, such as a collision of two servos, unchanged."""
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


def _spoiled(spoil: Spoil) -> Inject:
    """Return an injector of a change to a servo's answers."""

    def inject(assembly: HandAssembly, fault: Injection) -> Active:
        def begin() -> None:
            if not isinstance(assembly.electronics.bus.tap, SpoiledAnswers):
                assembly.electronics.bus.tap = SpoiledAnswers(assembly.electronics.kernel, assembly.fire)
            assembly.electronics.bus.tap.add(fault, spoil, assembly.random(fault))

        def clear() -> None:
            if isinstance(tap := assembly.electronics.bus.tap, SpoiledAnswers):
                tap.remove(fault)

        return Active(begin, clear)

    return inject


# fmt: off
FAULTS = (
    Fault("servo_silent", BUS, Part.BUS, "intermittent servo",
          _spoiled(_silent), ALL, Severity("ms of every 100", (15, 30, 70), 0, 100)),
    Fault("answers_damaged", BUS, Part.BUS, "answers of a servo are damaged",
          _spoiled(_damaged), ALL, share("answers", 0.05, 0.2, 0.6)),
    Fault("position_garbage", BUS, Part.SERVO, "random position readings",
          _spoiled(_garbage), ALL, share("readings", 0.01, 0.05, 0.3)),
    Fault("position_coarse", BUS, Part.SERVO, "a servo reports rounded positions",
          _spoiled(_coarse), ALL, Severity("counts", (8, 16, 64), 1, 1024)),
    Fault("temperature_wrong", BUS, Part.SERVO, "temperature readings too high",
          _spoiled(_warmer), ALL, Severity("°C", (10, 20, 40), -100, 100)),
    Fault("current_wrong", BUS, Part.SERVO, "a servo reports a wrong current",
          _spoiled(_current), ALL, Severity("factor", (1.3, 2, 4), 0, 100)),
)
# fmt: on
