"""One question at a time to any Feetech bus servo, over any byte stream.

The wire format is stated here on its own, beside the emulator's, so that a misread number makes them disagree. Nothing
here needs the maker's SDK, so that what a driver misreads does not hide what a servo says.
`FF FF id length code parameters checksum`; source: FTServo_Arduino v2.0.0, `SCS.cpp`.
"""

from __future__ import annotations

from typing import NamedTuple

from aero.transport import Transport

PATIENCE_S = 0.02
"""How long an answer may take, s: 0.3 ms on the wire, and what a USB adapter holds back (16 ms of an FTDI chip)."""
PING, READ, WRITE, CALIBRATE = 1, 2, 3, 11
OVERHEAD = 6
"""Bytes of an answer without parameters."""


class ServoAnswer(NamedTuple):
    """What came back from one servo."""

    status: int
    """Error bits: 1 voltage, 2 encoder, 4 temperature, 8 current, 32 overload."""
    data: bytes
    """Registers that were asked for."""


class NoAnswerError(Exception):
    """Nothing came within the time, or nothing but the request itself."""


class DamagedAnswerError(Exception):
    """Something came that is no answer of this servo: a wrong header, ID, length or checksum."""


def request(servo: int, code: int, parameters: bytes = b"") -> bytes:
    """Return the bytes of one instruction."""
    body = bytes((servo, len(parameters) + 2, code)) + parameters
    return b"\xff\xff" + body + bytes((~sum(body) & 0xFF,))


def parse_answer(received: bytes, servo: int, count: int) -> ServoAnswer:
    """Return the answer with `count` registers that these bytes are, and nothing else.

    Raises:
        NoAnswerError: no bytes at all.
        DamagedAnswerError: they are not that answer.
    """
    if not received:
        raise NoAnswerError(f"servo {servo} is silent")
    body = received[2:]
    if len(received) != count + OVERHEAD or received[:2] != b"\xff\xff" or body[:2] != bytes((servo, count + 2)):
        raise DamagedAnswerError(f"servo {servo}: {received.hex(' ')} is no answer of it with {count} registers")
    if ~sum(body[:-1]) & 0xFF != body[-1]:
        raise DamagedAnswerError(f"servo {servo}: the checksum of {received.hex(' ')} is wrong")
    return ServoAnswer(body[2], body[3:-1])


class FeetechBus:
    """A master on a bus.

    Input is dropped before each request, so that an answer that came too late is never taken for the next one. Many
    half-duplex adapters echo what they send: the echo is recognised and removed.
    """

    def __init__(self, transport: Transport, *, patience_s: float = PATIENCE_S) -> None:
        """Use an open byte stream at the servos' baud rate; `patience_s` is the longest wait for an answer."""
        self._transport = transport
        self._patience_s = patience_s
        self.echoes: bool | None = None
        """Whether the line echoes what is sent; None before the first request."""

    def ping(self, servo: int) -> ServoAnswer:
        """Ask whether a servo is there; raises what `parse_answer` does."""
        return self._ask(servo, PING, b"", 0)

    def read(self, servo: int, address: int, count: int) -> ServoAnswer:
        """Read `count` registers; raises what `parse_answer` does."""
        return self._ask(servo, READ, bytes((address, count)), count)

    def write(self, servo: int, address: int, data: bytes) -> ServoAnswer:
        """Write registers; raises what `parse_answer` does, as when a servo acknowledges nothing."""
        return self._ask(servo, WRITE, bytes((address,)) + data, 0)

    def calibrate(self, servo: int) -> ServoAnswer:
        """Let a servo make its present position the middle; raises what `parse_answer` does."""
        return self._ask(servo, CALIBRATE, b"", 0)

    def _ask(self, servo: int, code: int, parameters: bytes, count: int) -> ServoAnswer:
        if self.echoes is None:
            # A ping and the answer with the voltage bit are the same bytes; a read of one register and its answer,
            # which is shorter, never are.
            probe = request(servo, READ, b"\x03\x01")
            self.echoes = self._exchange(probe, len(probe) + OVERHEAD + 1).startswith(probe)
        sent = request(servo, code, parameters)
        received = self._exchange(sent, count + OVERHEAD + len(sent) * self.echoes)
        return parse_answer(received.removeprefix(sent) if self.echoes else received, servo, count)

    def _exchange(self, sent: bytes, size: int) -> bytes:
        self._transport.discard_input()
        self._transport.write(sent)
        return self._transport.read(size, self._patience_s)
