"""Setup of real servos on their bus before assembly: scan, read-out, ID, limits, centre.

Requests that could make a servo unusable or two servos indistinguishable are rejected before any write, as is every
write to a servo of an unknown model. Writes are read back; after a failed one the old value is restored. The EEPROM is
always locked again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import closing, contextmanager, suppress

from aero.serial_transport import SerialTransport
from feetech_robots.feetech_bus import DamagedAnswerError, FeetechBus, NoAnswerError
from feetech_robots.survey import (
    ANGLE_LIMITS,
    BAUD_RATES,
    CURRENT,
    FEEDBACK,
    ID,
    KINDS,
    OFFSET,
    TORQUE,
    Surveyed,
    find,
    survey,
)

IDS = range(254)
TRIES = 3
"""Attempts of a write or read before a servo counts as silent."""
PATIENCE_S = 0.1
"""Time-out of an answer during setup, s; EEPROM writes take longer than measurements."""
MIDDLE, NEAR_COUNTS = 2048, 20
"""Position of a centred servo, and its tolerance for gear play, counts."""


class ServoBusError(RuntimeError):
    """Request that is unsafe or impossible on this bus or servo; the message names the remedy."""


class ServoValueError(ServoBusError):
    """Invalid value or unsupported request; nothing was written."""


class ServoSetup:
    """Setup operations for the servos on a bus."""

    def __init__(self, bus: FeetechBus) -> None:
        """Use a bus without other masters."""
        self._bus = bus

    @classmethod
    @contextmanager
    def open(cls, port: str, baud: int = BAUD_RATES[0]) -> Iterator[ServoSetup]:
        """Open an adapter's port at a baud rate, bit/s.

        Raises:
            ServoBusError: the port cannot be opened.
        """
        try:
            transport = SerialTransport.open(port, baud)
        except (ConnectionError, ValueError) as error:
            raise ServoBusError(f"cannot use the bus adapter: {error}") from error
        with closing(transport):
            yield cls(FeetechBus(transport, patience_s=PATIENCE_S))

    def scan(self, ids: Iterable[int] = IDS, progress: Callable[[int], None] | None = None) -> list[int]:
        """Return the IDs that answer a ping, in order; `progress` is called with each ID before its ping."""
        return find(self._bus, ids, progress)

    def read_out(self, servo: int) -> Surveyed:
        """Return the registers and measurements of a servo.

        Raises:
            ServoBusError: no servo, or more than one, answers at this ID.
        """
        if servo not in IDS:
            raise ServoValueError(f"an ID is 0 to 253, got {servo}")
        if not self._answers(servo):
            line = "; this line echoes what is sent" if self._bus.echoes else ""
            raise ServoBusError(f"no servo answers at ID {servo}; scan the bus, check power and cable{line}")
        # Two servos with one ID answer a ping with equal bytes. Their measurements differ and collide sooner or later,
        # because the current is noisy. Two emulated servos at rest agree in 7 % of the answers, often several in a row.
        found = survey(self._bus, servo, BAUD_RATES[0])
        if found.damaged:
            raise ServoBusError(
                f"the answer at ID {servo} is damaged, as if two servos shared that ID; leave one servo on the bus"
            )
        if found.model is None:
            raise ServoBusError(
                f"servo {servo} answers pings, and its registers could not be read; check power and cable"
            )
        return found

    def set_id(self, servo: int, new: int) -> None:
        """Change a servo's ID in EEPROM.

        Raises:
            ServoBusError: the new ID is invalid or taken, or not exactly one servo of a known model has the old ID.
        """
        if new not in IDS:
            raise ServoValueError(f"an ID is 0 to 253, got {new}")
        before = self._known(servo)
        if new == servo:
            return
        if self._answers(new):
            raise ServoBusError(f"ID {new} is taken; give that servo another ID first, or unplug it")
        with self._unlocked(before, (servo, new)):
            # Servos acknowledge with the old ID, with the new one, or not at all.
            with suppress(NoAnswerError, DamagedAnswerError):
                self._bus.write(servo, ID, bytes((new,)))
            answering = [at for at in (servo, new) if self._answers(at)]
        if answering != [new]:
            where = " and ".join(map(str, answering)) or "neither"
            raise ServoBusError(f"servo {servo} did not become {new}: of these two, {where} answers; scan the bus")
        self.read_out(new)

    def set_current_limit(self, servo: int, limit: int) -> None:
        """Set the protection current (register units) in EEPROM; the hand's homing requires 1023.

        Raises:
            ServoBusError: the limit is invalid or unsupported, or not exactly one servo of a known model has the ID.
        """
        before = self._known(servo)
        largest = before.kind.largest_current
        if largest is None:
            raise ServoValueError(f"servo {servo} is an {before.kind.name}, which has no protection current")
        if not 0 <= limit <= largest:
            raise ServoValueError(f"a current limit of an {before.kind.name} is 0 to {largest} units, got {limit}")
        self._store(before, CURRENT, limit)

    def set_angle_limits(self, servo: int, low: int, high: int) -> None:
        """Set the angle limits (counts) in EEPROM; both 0 removes the limits, as homing requires.

        Raises:
            ServoBusError: the limits are invalid, or not exactly one servo of a known model has the ID.
        """
        before = self._known(servo)
        kind = before.kind
        if (low, high) == (0, 0) and kind.zeros_make_a_motor:
            raise ServoValueError(
                f"angle limits 0 and 0 put an {kind.name} into motor mode; use 0 and {kind.largest_counts}"
            )
        if (low, high) != (0, 0) and not 0 <= low < high <= kind.largest_counts:
            raise ServoValueError(
                f"angle limits of an {kind.name} are 0 <= low < high <= {kind.largest_counts}, or 0 and 0; "
                f"got {low} and {high}"
            )
        self._store(before, ANGLE_LIMITS, low, high)

    def centre(self, servo: int) -> None:
        """Make the present position 2048 in EEPROM and switch the torque off.

        Raises:
            ServoBusError: not exactly one servo of a known model has the ID, or the calibration failed.
        """
        before = self._known(servo)
        if not before.kind.calibrates:
            raise ServoValueError(f"servo {servo} ({before.kind.name}) does not support `centre`")
        with self._unlocked(before, (servo,)):
            with suppress(NoAnswerError, DamagedAnswerError):
                self._bus.calibrate(servo)
            position = int.from_bytes(self._read(servo, FEEDBACK, 2), before.byte_order)
            if abs(position - MIDDLE) > NEAR_COUNTS:
                self._write(servo, OFFSET, before.offset_word.to_bytes(2, before.byte_order))
                raise ServoBusError(f"servo {servo} did not make its position {MIDDLE}; its offset was put back")

    def _known(self, servo: int) -> Surveyed:
        found = self.read_out(servo)
        if found.model not in KINDS:
            names = ", ".join(f"{kind.name} ({number})" for number, kind in KINDS.items())
            raise ServoValueError(
                f"servo {servo} is of model {found.model} ({found.kind.name}), whose registers are not known here; "
                f"nothing was written. Known are {names}"
            )
        return found

    def _answers(self, servo: int) -> bool:
        return bool(find(self._bus, (servo,) * TRIES))

    def _store(self, before: Surveyed, address: int, *words: int) -> None:
        data = b"".join(word.to_bytes(2, before.byte_order) for word in words)
        with self._unlocked(before, (before.id,)):
            old = self._read(before.id, address, len(data))
            try:
                self._write(before.id, address, data)
            except ServoBusError as error:
                self._write(before.id, address, old)
                raise ServoBusError(f"{error}; what it held was put back") from error

    @contextmanager
    def _unlocked(self, before: Surveyed, ids: Iterable[int]) -> Iterator[None]:
        """Switch the torque off and unlock the EEPROM; on exit lock the EEPROM of all `ids` that answer."""
        self._write(before.id, TORQUE, b"\0")
        try:
            self._write(before.id, before.kind.lock, b"\0")
            yield
        finally:
            for servo in ids:
                if self._answers(servo):
                    self._write(servo, before.kind.lock, b"\1")

    def _write(self, servo: int, address: int, data: bytes) -> None:
        """Write registers and verify by reading back, because acknowledgements may be lost or switched off."""
        for _ in range(TRIES):
            with suppress(NoAnswerError, DamagedAnswerError):
                self._bus.write(servo, address, data)
            if self._read(servo, address, len(data)) == data:
                return
        raise ServoBusError(f"servo {servo} did not keep what was written to register {address}")

    def _read(self, servo: int, address: int, count: int) -> bytes:
        for _ in range(TRIES):
            with suppress(NoAnswerError, DamagedAnswerError):
                return self._bus.read(servo, address, count).data
        raise ServoBusError(f"servo {servo} stopped answering; check power and cable, then read it out before going on")
