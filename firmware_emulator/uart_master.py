"""The servo library on the ESP32 as tasks: what it sends, what it accepts as an answer, and how long it waits.

Source: FTServo_Arduino v2.0.0 (64922cd), `SCS.cpp`, `SCSerial.cpp`, `HLSCL.cpp`. Its clock is `millis()`, so a wait of
"more than 10 ms" ends on the first whole millisecond after 11 have begun. Methods are tasks, called with `yield from`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

from firmware_emulator.bus import Answer, ServoBus
from firmware_emulator.kernel import TASK_YIELD, Signal, Task, milliseconds
from firmware_emulator.packets import BROADCAST, HEADER, Instruction, pack

BYTE_TIMEOUT_MS = 10
SYNC_WINDOW_MS = 8
HEADER_BYTES = 11
"""The header has to be complete within this many bytes."""

TRAIN_BUFFER = 512
"""What a sync read is received into, with room for what the library reads behind its end."""

_request = lru_cache(maxsize=256)(pack)
"""The firmware sends few different packets very often."""


def _after_ms(t: float, limit_ms: int) -> float:
    """Time (s) at which `millis()` differs from its value at `t` by more than `limit_ms`."""
    return (milliseconds(t) + limit_ms + 1) / 1000.0


class UartMaster:
    """The only user of the servo UART; callers guard it with the bus lock."""

    def __init__(self, bus: ServoBus) -> None:
        self._kernel = bus.kernel
        self._port = bus.connect(self._receive)
        self._received = bytearray()
        self._arrived = Signal(bus.kernel)
        self._arrived_in_train = Signal(bus.kernel)
        self._trains = bytearray(TRAIN_BUFFER)
        self._at_once: list[Answer] = []
        """Answers that came at once and were not written into the buffer yet."""

    def ping(self, servo: int) -> Task:
        """Return whether a servo acknowledges a PING."""
        return self._acknowledged(servo, Instruction.PING, b"")

    def write(self, servo: int, address: int, data: bytes) -> Task:
        """Write registers; return whether it was acknowledged (the error byte is not looked at)."""
        return self._acknowledged(servo, Instruction.WRITE, bytes((address,)) + data)

    def calibrate(self, servo: int) -> Task:
        """Send the instruction that makes the present position 2048; return whether it was acknowledged."""
        return self._acknowledged(servo, Instruction.CALIBRATE, b"")

    def read(self, servo: int, address: int, count: int) -> Task:
        """Return `count` bytes from a servo's registers, None when no valid answer came."""
        self._send(_request(servo, Instruction.READ, bytes((address, count))))
        if not (yield from self._header()):
            return None
        start = yield from self._take(3)
        # A wrong ID or length is refused before the rest is waited for.
        if start is None or start[:2] != bytes((servo, count + 2)):
            return None
        data = yield from self._take(count)
        check = None if data is None else (yield from self._take(1))
        return data if check is not None and ~sum(start + data) & 0xFF == check[0] else None

    def sync_write(self, address: int, rows: Sequence[tuple[int, bytes]]) -> None:
        """Write the same registers of several servos, `(servo, data)` each; nothing answers."""
        size = len(rows[0][1])
        body = b"".join(bytes((servo,)) + data for servo, data in rows)
        self._send(_request(BROADCAST, Instruction.SYNC_WRITE, bytes((address, size)) + body))

    def sync_read(self, address: int, count: int, servos: tuple[int, ...]) -> Task:
        """Return the registers of all `servos`, None as soon as one answer is missing or damaged."""
        request = _request(BROADCAST, Instruction.SYNC_READ, bytes((address, count, *servos)))
        deadline = _after_ms(self._kernel.now, SYNC_WINDOW_MS)
        self._received.clear()
        answers = self._port.sync_read(request, address, count, servos, deadline)
        if answers is not None:
            self._at_once = answers
            blocks = [block for _, _, block in answers]
            # Nothing in them looks like a header: the search below would find each in its place.
            if b"\xff" not in b"".join(blocks):
                return blocks
        size = len(servos) * (count + 6)
        train = self._buffered_trains()
        taken = b"" if answers is None else bytes(train[:size])
        while len(taken) < size:
            if not (yield self._arrived_in_train, deadline):
                break
            taken += self._pull(size - len(taken))
        # The buffer is not emptied: behind a train that was cut short stands what came before.
        train[: len(taken)] = taken
        if _is_regular(taken, servos, count):
            return [taken[at + 5 : at + 5 + count] for at in range(0, size, count + 6)]
        found = [_find_answer(bytes(train), len(taken), servo, count) for servo in servos]
        return None if None in found else found

    def _buffered_trains(self) -> bytearray:
        """Return the buffer of trains, with the answers that came at once in it."""
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
        # Where two tasks poll at once, in the repair after homing, the one whose tick came last looks first.
        self._arrived_in_train.fire()
        self._arrived.fire()

    def _pull(self, count: int) -> bytes:
        """Take up to `count` bytes of what is there."""
        taken = bytes(self._received[:count])
        del self._received[:count]
        return taken

    def _header(self) -> Task:
        """Drop bytes up to a header; return whether one came in time."""
        seen = b""
        while len(seen) < HEADER_BYTES:
            # As many as a header still lacks at least: two, or one behind a first FF.
            more = yield from self._take(1 if seen.endswith(b"\xff") else min(2, HEADER_BYTES - len(seen)))
            if more is None:
                return False
            seen += more
            if seen.endswith(HEADER):
                return True
        return False

    def _take(self, count: int) -> Task:
        """Return the next `count` bytes, None once no byte has come for the time-out."""
        taken = self._pull(count)
        deadline = _after_ms(self._kernel.now, BYTE_TIMEOUT_MS)
        while len(taken) < count:
            arrived = yield self._arrived, deadline
            # A task whose tick has come goes before one that polls, as in the main loop.
            yield TASK_YIELD
            yield TASK_YIELD
            if more := self._pull(count - len(taken)):
                taken += more
                deadline = _after_ms(self._kernel.now, BYTE_TIMEOUT_MS)
            elif not arrived:
                return None
        return taken


def _is_regular(train: bytes, servos: Sequence[int], count: int) -> bool:
    """Whether a train holds the right answers in their places and nothing else that looks like a header.

    A search would then find them there, at many times the cost.
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
    """Return one servo's registers from a train of answers as the library finds them, None when it does not.

    It looks for a header and an ID everywhere, believes a length and a checksum even behind `size`, and gives up at
    the first checksum that is wrong.
    """
    at = 0
    while at + 6 + count <= size:
        header = train.find(HEADER, at, size)
        # The byte behind the last FF is the ID; without a header it is the last byte of all.
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
