"""The servo library on the ESP32 as tasks: what it sends, what it accepts as an answer, and how long it waits.

Source: FTServo_Arduino v2.0.0 (64922cd), `SCS.cpp`, `SCSerial.cpp`, `HLSCL.cpp`. Its clock is `millis()`, so a wait of
"more than 10 ms" ends on the first whole millisecond after 11 have begun. Methods are tasks, called with `yield from`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

from firmware_emulator.bus import ServoBus
from firmware_emulator.kernel import Signal, Task
from firmware_emulator.packets import BROADCAST, HEADER, Instruction, pack

BYTE_TIMEOUT_MS = 10
SYNC_WINDOW_MS = 8
HEADER_BYTES = 11
"""The header has to be complete within this many bytes."""

_request = lru_cache(maxsize=256)(pack)
"""The firmware sends few different packets very often."""


def _after_ms(t: float, milliseconds: int) -> float:
    """Time (s) at which `millis()` differs from its value at `t` by more than `milliseconds`."""
    return (math.floor(t * 1000.0 + 1e-6) + milliseconds + 1) / 1000.0


class UartMaster:
    """The only user of the servo UART; callers guard it with the bus lock."""

    def __init__(self, bus: ServoBus) -> None:
        self._kernel = bus.kernel
        self._port = bus.connect(self._receive)
        self._received = bytearray()
        self._arrived = Signal(bus.kernel)

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
        body = yield from self._take(3 + count + 1)
        if body is None or body[0] != servo or body[1] != count + 2 or ~sum(body[:-1]) & 0xFF != body[-1]:
            return None
        return body[3:-1]

    def sync_write(self, address: int, rows: Sequence[tuple[int, bytes]]) -> None:
        """Write the same registers of several servos, `(servo, data)` each; nothing answers."""
        size = len(rows[0][1])
        body = b"".join(bytes((servo,)) + data for servo, data in rows)
        self._send(_request(BROADCAST, Instruction.SYNC_WRITE, bytes((address, size)) + body))

    def sync_read(self, address: int, count: int, servos: tuple[int, ...]) -> Task:
        """Return the registers of all `servos`, None as soon as one answer is missing or damaged."""
        self._send(_request(BROADCAST, Instruction.SYNC_READ, bytes((address, count, *servos))))
        size = len(servos) * (count + 6)
        deadline = _after_ms(self._kernel.now, SYNC_WINDOW_MS)
        while len(self._received) < size:
            if not (yield self._arrived, deadline):
                break
        received = bytes(self._received)
        answers: list[bytes] = []
        for servo in servos:
            # An ID is looked for everywhere; where it is expected, behind the one before it, comes first.
            start = HEADER + bytes((servo, count + 2))
            at = len(answers) * (count + 6)
            if not received.startswith(start, at):
                at = received.find(start)
            body = received[at + 2 : at + 6 + count] if at >= 0 else b""
            if len(body) < count + 4 or (sum(body) + 1) & 0xFF:
                return None
            answers.append(body[3:-1])
        return answers

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
        self._arrived.fire()

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
        received = self._received
        while len(received) < count:
            if not (yield self._arrived, _after_ms(self._kernel.now, BYTE_TIMEOUT_MS)):
                return None
        taken = bytes(received[:count])
        del received[:count]
        return taken
