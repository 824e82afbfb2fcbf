"""Servo library of the ESP32 as tasks (called with `yield from`): requests, answer checks and time-outs.

Source: FTServo_Arduino v2.0.0 (64922cd), `SCS.cpp`, `SCSerial.cpp`, `HLSCL.cpp`. The library measures time with
`millis()`, so a wait of "more than 10 ms" ends when the counter has advanced by 11.
"""

from collections.abc import Sequence
from functools import lru_cache

from firmware_emulator.bus import Answer, ServoBus
from firmware_emulator.kernel import TASK_YIELD, Signal, Task, milliseconds
from firmware_emulator.packets import BROADCAST, HEADER, Instruction, pack

BYTE_TIMEOUT_MS = 10
SYNC_WINDOW_MS = 8
HEADER_BYTES = 11
"""Number of bytes within which the header must be complete."""

TRAIN_BUFFER = 512
"""Size of the sync-read buffer, bytes, with room for the library's reads past its end."""

_request = lru_cache(maxsize=256)(pack)
"""Cached `pack`: the firmware repeats few distinct packets."""


def _after_ms(t: float, limit_ms: int) -> float:
    """Return the time (s) at which `millis()` exceeds its value at `t` by more than `limit_ms`."""
    return (milliseconds(t) + limit_ms + 1) / 1000.0


class UartMaster:
    """Sole user of the servo UART; callers hold the bus lock."""

    def __init__(self, bus: ServoBus) -> None:
        self._kernel = bus.kernel
        self._port = bus.connect(self._receive)
        self._received = bytearray()
        self._arrived = Signal(bus.kernel)
        self._arrived_in_train = Signal(bus.kernel)
        self._trains = bytearray(TRAIN_BUFFER)
        self._at_once: list[Answer] = []
        """Answers of a one-step sync read, not yet copied to the buffer."""

    def ping(self, servo: int) -> Task:
        """Return whether a servo acknowledges a PING."""
        return self._acknowledged(servo, Instruction.PING, b"")

    def write(self, servo: int, address: int, data: bytes) -> Task:
        """Write registers; return whether the servo acknowledged (its error byte is ignored)."""
        return self._acknowledged(servo, Instruction.WRITE, bytes((address,)) + data)

    def calibrate(self, servo: int) -> Task:
        """Make the present position 2048 (CALIBRATE); return whether the servo acknowledged."""
        return self._acknowledged(servo, Instruction.CALIBRATE, b"")

    def read(self, servo: int, address: int, count: int) -> Task:
        """Return `count` bytes of a servo's registers, or None without a valid answer."""
        self._send(_request(servo, Instruction.READ, bytes((address, count))))
        if not (yield from self._header()):
            return None
        start = yield from self._take(3)
        # As in the library, a wrong ID or length ends the read without waiting for the remaining bytes.
        if start is None or start[:2] != bytes((servo, count + 2)):
            return None
        data = yield from self._take(count)
        check = None if data is None else (yield from self._take(1))
        return data if check is not None and ~sum(start + data) & 0xFF == check[0] else None

    def sync_write(self, address: int, rows: Sequence[tuple[int, bytes]]) -> None:
        """Write registers of several servos, one `(servo, data)` row each, without an answer."""
        size = len(rows[0][1])
        body = b"".join(bytes((servo,)) + data for servo, data in rows)
        self._send(_request(BROADCAST, Instruction.SYNC_WRITE, bytes((address, size)) + body))

    def sync_read(self, address: int, count: int, servos: tuple[int, ...]) -> Task:
        """Return the registers of all `servos`, or None if any answer is missing or damaged."""
        request = _request(BROADCAST, Instruction.SYNC_READ, bytes((address, count, *servos)))
        deadline = _after_ms(self._kernel.now, SYNC_WINDOW_MS)
        self._received.clear()
        answers = self._port.sync_read(request, address, count, servos, deadline)
        if answers is not None:
            self._at_once = answers
            blocks = [block for _, _, block in answers]
            # Without an FF no block contains a header, so the search below would find each in its place.
            if b"\xff" not in b"".join(blocks):
                return blocks
        size = len(servos) * (count + 6)
        train = self._buffered_trains()
        taken = b"" if answers is None else bytes(train[:size])
        while len(taken) < size:
            if not (yield self._arrived_in_train, deadline):
                break
            taken += self._pull(size - len(taken))
        # As in the library, the buffer is not cleared: a short train is followed by older bytes.
        train[: len(taken)] = taken
        if _is_regular(taken, servos, count):
            return [taken[at + 5 : at + 5 + count] for at in range(0, size, count + 6)]
        found = [_find_answer(bytes(train), len(taken), servo, count) for servo in servos]
        return None if None in found else found

    def _buffered_trains(self) -> bytearray:
        """Return the sync-read buffer after copying the pending one-step answers into it."""
        train, self._at_once = b"".join(pack(*answer) for answer in self._at_once), []
        self._trains[: len(train)] = train
        return self._trains

    def _acknowledged(self, servo: int, instruction: int, parameters: bytes) -> Task:
        self._send(_request(servo, instruction, parameters))
        if not (yield from self._header()):
            return False
        body = yield from self._take(4)
        return body is not None and body[:2] == bytes((servo, 2)) and ~sum(body[:3]) & 0xFF == body[3]

    def _send(self, data: bytes) -> None:
        self._received.clear()
        self._port.write(data)

    def _receive(self, data: bytes) -> None:
        self._received += data
        # If two tasks poll at once (repair after homing), the one with the later tick polls first.
        self._arrived_in_train.fire()
        self._arrived.fire()

    def _pull(self, count: int) -> bytes:
        taken = bytes(self._received[:count])
        del self._received[:count]
        return taken

    def _header(self) -> Task:
        """Drop bytes up to a header; return whether a header arrived in time."""
        seen = b""
        while len(seen) < HEADER_BYTES:
            # Minimum number of bytes missing from a header: two, or one after a first FF.
            more = yield from self._take(1 if seen.endswith(b"\xff") else min(2, HEADER_BYTES - len(seen)))
            if more is None:
                return False
            seen += more
            if seen.endswith(HEADER):
                return True
        return False

    def _take(self, count: int) -> Task:
        """Return the next `count` bytes, or None if no byte arrives within the time-out."""
        taken = self._pull(count)
        deadline = _after_ms(self._kernel.now, BYTE_TIMEOUT_MS)
        while len(taken) < count:
            arrived = yield self._arrived, deadline
            # Tasks that are due at a tick run before one that polls, as in the main loop.
            yield TASK_YIELD
            yield TASK_YIELD
            if more := self._pull(count - len(taken)):
                taken += more
                deadline = _after_ms(self._kernel.now, BYTE_TIMEOUT_MS)
            elif not arrived:
                return None
        return taken


def _is_regular(train: bytes, servos: Sequence[int], count: int) -> bool:
    """Return whether a train consists of the expected answers in order, without any other header pattern.

    Shortcut: the full search gives equal results at many times the cost.
    """
    each, answers = count + 6, len(servos)
    return (
        len(train) == answers * each
        and train.count(HEADER) == answers
        and train[::each] == train[1::each] == b"\xff" * answers
        and train[2::each] == bytes(servos)
        and train[3::each] == bytes((count + 2,)) * answers
        and all((sum(train[at + 2 : at + each]) + 1) & 0xFF == 0 for at in range(0, len(train), each))
    )


def _find_answer(train: bytes, size: int, servo: int, count: int) -> bytes | None:
    """Return one servo's registers from a train of answers by the library's search, or None.

    The library searches the whole train for a header and the ID, accepts length and checksum bytes even behind `size`,
    and gives up at the first wrong checksum.
    """
    at = 0
    while at + 6 + count <= size:
        header = train.find(HEADER, at, size)
        # The byte after the last FF is the ID; without a header, the last byte of the train is used.
        while header >= 0 and header + 2 < size and train[header + 2] == 0xFF:
            header += 1
        at = header + 3 if 0 <= header < size - 2 else size
        found = train[at - 1]
        if found != servo:
            continue
        at += 1
        if train[at - 1] != count + 2:
            continue
        body = train[at - 2 : at + 2 + count]
        return bytes(body[3:-1]) if (sum(body) + 1) & 0xFF == 0 else None
    return None
