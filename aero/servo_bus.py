"""Setting up real servos on their bus, before a hand is assembled: scan, read out, ID, limits, centre.

Uses `feetech-servo-sdk` (extra `servo`) on a USB adapter; the hand's board must not be on the same bus. Everything that
could leave a servo unusable or two servos inseparable is refused before anything is written.

Registers and units: FTServo_Arduino v2.0.0 `HLSCL.h`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from types import TracebackType

try:
    import scservo_sdk as feetech
except ImportError as error:
    raise ImportError("aero.servo_bus needs feetech-servo-sdk, of the extra `servo`") from error

BAUD = 1_000_000
IDS = range(254)
CALIBRATE = 0x0B
MAX_CURRENT = 1023
MAX_COUNTS = 4095
MODEL = 2570
"""Model word of the HLS3606M that the hand uses."""
_ID, _LIMITS, _CURRENT, _TORQUE, _LOCK, _FEEDBACK = 5, 9, 28, 40, 55, 56
_FEEDBACK_SIZE = 15
_COLLISION_READS = 16


class ServoBusError(RuntimeError):
    """Something about the bus or a servo makes the request unsafe or impossible; the text says what to do."""


class ServoValueError(ServoBusError):
    """A value that no servo takes; nothing was sent."""


@dataclass(frozen=True)
class ServoReadout:
    """What one servo says about itself."""

    id: int
    """Bus ID."""
    model: int
    """Model word; 2570 for the HLS3606M."""
    position_counts: int
    """Present position, counts, 4096 a turn."""
    angle_limits_counts: tuple[int, int]
    """Lowest and highest goal, counts; both 0 for no limits."""
    current_limit: int
    """Protection current, register units (nominally 6.5 mA)."""
    voltage: float
    """Supply, V."""
    temperature_c: int
    """Temperature, °C."""
    status: int
    """Error bits: 1 voltage, 2 encoder, 4 temperature, 8 current, 32 overload."""


class ServoSetup:
    """A bus adapter with servos on it; a context manager."""

    def __init__(self, port: str) -> None:
        """Open an adapter's port at 1 Mbit/s.

        Raises:
            ServoBusError: it cannot be opened.
        """
        self._port = feetech.PortHandler(port)
        self._packets = feetech.PacketHandler(0)
        try:
            opened = self._port.setBaudRate(BAUD)
        except OSError as error:
            raise ServoBusError(f"cannot open {port}: {error}; is the adapter plugged in, and free?") from error
        if not opened:
            raise ServoBusError(f"{port} does not take {BAUD} baud; use an adapter that does")

    def __enter__(self) -> ServoSetup:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._port.closePort()

    def scan(self, ids: Iterable[int] = IDS, progress: Callable[[int], None] | None = None) -> list[int]:
        """Return the IDs that answer a ping, in the order asked; `progress` gets each ID before it is asked."""
        found = []
        for servo in ids:
            if progress is not None:
                progress(servo)
            if self._answers(servo):
                found.append(servo)
        return found

    def read_out(self, servo: int) -> ServoReadout:
        """Return what a servo says about itself.

        Raises:
            ServoBusError: nobody answers at this ID, or more than one servo does.
        """
        self._require_one(servo)
        feedback = self._read(servo, _FEEDBACK, _FEEDBACK_SIZE)
        limits = self._read(servo, _LIMITS, 4)
        position = feedback[0] | feedback[1] << 8
        return ServoReadout(
            id=servo,
            model=int.from_bytes(self._read(servo, 3, 2), "little"),
            position_counts=position if position < 0x8000 else 0x8000 - position,
            angle_limits_counts=(limits[0] | limits[1] << 8, limits[2] | limits[3] << 8),
            current_limit=int.from_bytes(self._read(servo, _CURRENT, 2), "little"),
            voltage=feedback[6] / 10.0,
            temperature_c=feedback[7],
            status=feedback[9],
        )

    def set_id(self, servo: int, new: int) -> None:
        """Give a servo another ID, kept in its EEPROM.

        Raises:
            ServoBusError: the new ID is out of range or taken, or the old one is not that of exactly one servo.
        """
        if new not in IDS:
            raise ServoValueError(f"an ID is 0 to 253, got {new}")
        self._require_one(servo)
        if new == servo:
            return
        if self._answers(new):
            raise ServoBusError(f"ID {new} is taken; give that servo another ID first, or unplug it")
        self._unlock(servo)
        self._write(servo, _ID, [new])
        self._write(new, _LOCK, [1])
        self._require_one(new)

    def set_current_limit(self, servo: int, limit: int) -> None:
        """Set the protection current (register units, 0..1023), kept in EEPROM; homing needs 1023.

        Raises:
            ServoBusError: the limit is out of range, or the ID is not that of exactly one servo.
        """
        if not 0 <= limit <= MAX_CURRENT:
            raise ServoValueError(f"a current limit is 0 to {MAX_CURRENT} units, got {limit}")
        self._keep(servo, _CURRENT, [limit & 0xFF, limit >> 8])

    def set_angle_limits(self, servo: int, low: int, high: int) -> None:
        """Set the range of goals (counts), kept in EEPROM; both 0 takes the limits away, which homing needs.

        Raises:
            ServoBusError: the limits are out of range or order, or the ID is not that of exactly one servo.
        """
        if (low, high) != (0, 0) and not 0 <= low < high <= MAX_COUNTS:
            raise ServoValueError(f"angle limits are 0 <= low < high <= {MAX_COUNTS}, or 0 and 0; got {low} and {high}")
        self._keep(servo, _LIMITS, [low & 0xFF, low >> 8, high & 0xFF, high >> 8])

    def centre(self, servo: int) -> None:
        """Make the present position 2048, kept in EEPROM; the torque is off afterwards.

        Raises:
            ServoBusError: the ID is not that of exactly one servo, or the servo does not do it.
        """
        self._require_one(servo)
        self._unlock(servo)
        _, result, _ = self._packets.txRxPacket(self._port, [0, 0, servo, 2, CALIBRATE, 0])
        self._check(servo, result)
        self._write(servo, _LOCK, [1])

    def _answers(self, servo: int) -> bool:
        return bool(self._packets.ping(self._port, servo)[1] == feetech.COMM_SUCCESS)

    def _require_one(self, servo: int) -> None:
        if servo not in IDS:
            raise ServoValueError(f"an ID is 0 to 253, got {servo}")
        # Two servos answer a ping with the same bytes at the same time; their measurements differ and collide, if not
        # at once then soon, because the current is noisy. Two emulated servos at rest agree in 7 % of the answers,
        # often in several in a row.
        for _ in range(_COLLISION_READS):
            _, result, _ = self._packets.readTxRx(self._port, servo, _FEEDBACK, _FEEDBACK_SIZE)
            if result != feetech.COMM_SUCCESS:
                break
        else:
            return
        if result == feetech.COMM_RX_TIMEOUT and not self._answers(servo):
            raise ServoBusError(f"no servo answers at ID {servo}; scan the bus, check power and cable")
        raise ServoBusError(
            f"the answer at ID {servo} is damaged, as if two servos shared that ID; leave one servo on the bus"
        )

    def _keep(self, servo: int, address: int, data: list[int]) -> None:
        self._require_one(servo)
        self._unlock(servo)
        self._write(servo, address, data)
        self._write(servo, _LOCK, [1])
        if list(self._read(servo, address, len(data))) != data:
            raise ServoBusError(f"servo {servo} did not keep what was written to register {address}; try again")

    def _unlock(self, servo: int) -> None:
        self._write(servo, _TORQUE, [0])
        self._write(servo, _LOCK, [0])

    def _write(self, servo: int, address: int, data: list[int]) -> None:
        result, _ = self._packets.writeTxRx(self._port, servo, address, len(data), data)
        self._check(servo, result)

    def _read(self, servo: int, address: int, count: int) -> bytes:
        data, result, _ = self._packets.readTxRx(self._port, servo, address, count)
        self._check(servo, result)
        return bytes(data)

    def _check(self, servo: int, result: int) -> None:
        if result != feetech.COMM_SUCCESS:
            said = self._packets.getTxRxResult(result)
            raise ServoBusError(f"servo {servo}: {said}; check power and cable, then read it out before going on")
