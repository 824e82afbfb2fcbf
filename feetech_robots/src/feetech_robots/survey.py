"""What one servo says of itself, read without changing anything."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from feetech_robots.feetech_bus import DamagedAnswerError, FeetechBus, NoAnswerError

READS = 20
"""How often the measurements are read, to tell a good line from a bad one."""
TRIES = 3
"""Of what has to be known once."""
ID, ANGLE_LIMITS, CURRENT, OFFSET, MODE, TORQUE = 5, 9, 28, 31, 33, 40
PHASE, COUNTS_TURNS = 18, 0x10
FEEDBACK, FEEDBACK_SIZE = 56, 15
BAUD_RATES = (1_000_000, 500_000, 250_000, 128_000, 115_200, 76_800, 57_600, 38_400)
"""By the value of register 6: maker's SDK, `SMS_STS.h`."""


@dataclass(frozen=True)
class ServoKind:
    """What has to be known of a kind of servo to read it and to set it up."""

    name: str
    offset_sign_bit: int | None
    """None where there is no offset."""
    lock: int
    """Address of the lock of the EEPROM."""
    largest_counts: int
    """Largest position."""
    largest_current: int | None = None
    """Largest protection current, register units; None where there is none."""
    calibrates: bool = False
    """Whether an instruction makes the present position the middle."""
    zeros_make_a_motor: bool = False
    """Whether both angle limits at 0 make a motor of it, without positions."""
    turns: bool = False
    """Whether its maker ships it counting turns."""


KINDS = {
    2570: ServoKind("HLS3606M", 15, 55, 4095, 1023, calibrates=True, turns=True),
    777: ServoKind("STS3215", 11, 55, 4095, 511, calibrates=True),
    2825: ServoKind("STS3250", 11, 55, 4095, 511, calibrates=True),
    11272: ServoKind("SM8512BL", 11, 55, 4095, 511),
    1284: ServoKind("SCS0009", None, 48, 1023, zeros_make_a_motor=True),
}
"""By model number. Sources: LeRobot 0.6.1, motors/feetech/tables.py; the HLS3606M of the Aero Hand; currents: the
transcribed memory tables."""
BIG_ENDIAN = ServoKind("SCS series", None, 48, 1023)
LITTLE_ENDIAN = ServoKind("STS, SMS or HLS series", 11, 55, 4095)


@dataclass(frozen=True)
class Surveyed:
    """One servo."""

    id: int
    baud: int
    """bit/s at which it answers."""
    silent: int
    """Of `READS`, reads without an answer."""
    damaged: int
    """Of `READS`, reads with an invalid answer."""
    pings_damaged: int
    """Of `TRIES`."""
    model: int | None
    """Model number, None where it could not be read; then the rest is empty too."""
    kind: ServoKind = LITTLE_ENDIAN
    big_endian: bool = False
    firmware: tuple[int, int] = (0, 0)
    status: int = 0
    """Error bits."""
    response_level: int = 1
    limits_counts: tuple[int, int] = (0, 0)
    current_limit: int | None = None
    """Protection current, register units (nominally 6.5 mA); None where there is none."""
    max_temperature_c: int = 0
    voltage_limits_v: tuple[float, float] = (0.0, 0.0)
    offset_word: int = 0
    """As it stands in the register."""
    counts_turns: bool = False
    """Whether its readings go on beyond a turn (bit 4 of register 18)."""
    mode: int = 0
    torque: int = 0
    unlocked: bool = False
    """Whether EEPROM writes are kept."""
    position_counts: int = 0
    voltage_v: float = 0.0
    temperature_c: int = 0

    @property
    def byte_order(self) -> Literal["big", "little"]:
        """Order of the bytes of a register of two."""
        return "big" if self.big_endian else "little"

    @property
    def offset_counts(self) -> int:
        """The offset that the register means."""
        bit = self.kind.offset_sign_bit
        if bit is None:
            return 0
        magnitude = self.offset_word & (1 << bit) - 1
        return -magnitude if self.offset_word >> bit & 1 else magnitude


def find(bus: FeetechBus, ids: Iterable[int], progress: Callable[[int], None] | None = None) -> list[int]:
    """Return the IDs at which anything answers a ping; `progress` gets each ID before it is asked."""
    found = []
    for servo in ids:
        if progress is not None:
            progress(servo)
        try:
            bus.ping(servo)
        except NoAnswerError:
            continue
        except DamagedAnswerError:
            # Two servos at once, or a bad line: somebody is there.
            pass
        found.append(servo)
    return found


def survey(bus: FeetechBus, servo: int, baud: int) -> Surveyed:
    """Read one servo; a register that it does not give is as if it were not there."""
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
