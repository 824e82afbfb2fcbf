"""Read-only survey of the servos on a bus."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from feetech_robots.feetech_bus import DamagedAnswerError, FeetechBus, NoAnswerError

READS = 20
"""Number of measurement reads, to assess the quality of the line."""
TRIES = 3
"""Attempts of each ping and register read."""
ID, ANGLE_LIMITS, CURRENT, OFFSET, MODE, TORQUE = 5, 9, 28, 31, 33, 40
PHASE, COUNTS_TURNS = 18, 0x10
FEEDBACK, FEEDBACK_SIZE = 56, 15
BAUD_RATES = (1_000_000, 500_000, 250_000, 128_000, 115_200, 76_800, 57_600, 38_400)
"""Baud rates by the value of register 6. Source: maker's SDK, `SMS_STS.h`."""


@dataclass(frozen=True)
class ServoKind:
    """Properties of a servo model for reading and setup."""

    name: str
    offset_sign_bit: int | None
    """Sign bit of the offset register; None without an offset."""
    lock: int
    """Address of the EEPROM lock."""
    largest_counts: int
    """Largest position, counts."""
    largest_current: int | None = None
    """Largest protection current, register units; None without one."""
    calibrates: bool = False
    """Whether the servo supports CALIBRATE."""
    zeros_make_a_motor: bool = False
    """Whether both angle limits at 0 select motor mode, without positions."""
    turns: bool = False
    """Whether the factory setting counts turns."""


KINDS = {
    2570: ServoKind("HLS3606M", 15, 55, 4095, 1023, calibrates=True, turns=True),
    777: ServoKind("STS3215", 11, 55, 4095, 511, calibrates=True),
    2825: ServoKind("STS3250", 11, 55, 4095, 511, calibrates=True),
    11272: ServoKind("SM8512BL", 11, 55, 4095, 511),
    1284: ServoKind("SCS0009", None, 48, 1023, zeros_make_a_motor=True),
}
"""Servo models by model number. Sources: LeRobot 0.6.1, motors/feetech/tables.py; the HLS3606M of the Aero Hand;
currents: the transcribed memory tables."""
BIG_ENDIAN = ServoKind("SCS series", None, 48, 1023)
LITTLE_ENDIAN = ServoKind("STS, SMS or HLS series", 11, 55, 4095)


@dataclass(frozen=True)
class Surveyed:
    """Survey result of one servo."""

    id: int
    baud: int
    """Baud rate of the answers, bit/s."""
    silent: int
    """Number of the `READS` reads without an answer."""
    damaged: int
    """Number of the `READS` reads with an invalid answer."""
    pings_damaged: int
    """Number of the `TRIES` pings without a valid answer."""
    model: int | None
    """Model number; None if unreadable, with defaults in all later fields."""
    kind: ServoKind = LITTLE_ENDIAN
    big_endian: bool = False
    firmware: tuple[int, int] = (0, 0)
    status: int = 0
    """Error bits."""
    response_level: int = 1
    limits_counts: tuple[int, int] = (0, 0)
    current_limit: int | None = None
    """Protection current, register units (nominally 6.5 mA); None without one."""
    max_temperature_c: int = 0
    voltage_limits_v: tuple[float, float] = (0.0, 0.0)
    offset_word: int = 0
    """Raw word of the offset register."""
    counts_turns: bool = False
    """Whether position readings count turns (bit 4 of register 18)."""
    mode: int = 0
    torque: int = 0
    unlocked: bool = False
    """Whether the EEPROM is unlocked."""
    position_counts: int = 0
    voltage_v: float = 0.0
    temperature_c: int = 0

    @property
    def byte_order(self) -> Literal["big", "little"]:
        """Byte order of two-byte registers."""
        return "big" if self.big_endian else "little"

    @property
    def offset_counts(self) -> int:
        """Offset decoded from the register, counts."""
        bit = self.kind.offset_sign_bit
        if bit is None:
            return 0
        magnitude = self.offset_word & (1 << bit) - 1
        return -magnitude if self.offset_word >> bit & 1 else magnitude


def find(bus: FeetechBus, ids: Iterable[int], progress: Callable[[int], None] | None = None) -> list[int]:
    """Return the IDs with any answer to a ping; `progress` is called with each ID before its ping."""
    found = []
    for servo in ids:
        if progress is not None:
            progress(servo)
        try:
            bus.ping(servo)
        except NoAnswerError:
            continue
        except DamagedAnswerError:
            # Two servos with one ID, or a bad line: in both cases a servo is present.
            pass
        found.append(servo)
    return found


def survey(bus: FeetechBus, servo: int, baud: int) -> Surveyed:
    """Survey one servo; `model` is None if its registers cannot be read."""
    silent = damaged = 0
    for _ in range(READS):
        try:
            bus.read(servo, FEEDBACK, FEEDBACK_SIZE)
        except NoAnswerError:
            silent += 1
        except DamagedAnswerError:
            damaged += 1
    pings_damaged = sum(not _pinged(bus, servo) for _ in range(TRIES))
    head = _read(bus, servo, 0, CURRENT + 2)
    rest = _read(bus, servo, OFFSET, 30)
    feedback = _read(bus, servo, FEEDBACK, 10)
    if head is None or rest is None or feedback is None:
        return Surveyed(servo, baud, silent, damaged, pings_damaged, None)
    big = bool(head[2])

    def word(data: Sequence[int], at: int) -> int:
        return data[at] << 8 | data[at + 1] if big else data[at] | data[at + 1] << 8

    model = word(head, 3)
    kind = KINDS.get(model, BIG_ENDIAN if big else LITTLE_ENDIAN)
    position = word(feedback, 0)
    return Surveyed(
        servo,
        baud,
        silent,
        damaged,
        pings_damaged,
        model,
        kind,
        big,
        (head[0], head[1]),
        status=feedback[9],
        response_level=head[8],
        limits_counts=(word(head, ANGLE_LIMITS), word(head, ANGLE_LIMITS + 2)),
        current_limit=None if kind.largest_current is None else word(head, CURRENT),
        max_temperature_c=head[13],
        voltage_limits_v=(head[15] / 10.0, head[14] / 10.0),
        offset_word=0 if kind.offset_sign_bit is None else word(rest, 0),
        counts_turns=kind.offset_sign_bit is not None and bool(head[PHASE] & COUNTS_TURNS),
        mode=0 if kind.offset_sign_bit is None else rest[MODE - OFFSET],
        torque=rest[TORQUE - OFFSET],
        unlocked=not rest[kind.lock - OFFSET],
        position_counts=position if big or position < 0x8000 else 0x8000 - position,
        voltage_v=feedback[6] / 10.0,
        temperature_c=feedback[7],
    )


def _pinged(bus: FeetechBus, servo: int) -> bool:
    try:
        bus.ping(servo)
    except (NoAnswerError, DamagedAnswerError):
        return False
    return True


def _read(bus: FeetechBus, servo: int, address: int, count: int) -> bytes | None:
    for _ in range(TRIES):
        try:
            return bus.read(servo, address, count).data
        except (NoAnswerError, DamagedAnswerError):
            continue
    return None
