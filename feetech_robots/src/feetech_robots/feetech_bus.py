"""Bus master for any Feetech servo over any byte stream, one request at a time.

The wire format is implemented independently of the emulator, so that a mistake in one of them shows up as a mismatch,
and independently of the maker's SDK and its errors.
`FF FF id length code parameters checksum`; source: FTServo_Arduino v2.0.0, `SCS.cpp`.
"""

from typing import NamedTuple

from aero.transport import Transport

PATIENCE_S = 0.02
"""Time-out of an answer, s: 0.3 ms on the wire plus the latency of a USB adapter (16 ms for an FTDI chip)."""
PING, READ, WRITE, CALIBRATE = 1, 2, 3, 11
OVERHEAD = 6
"""Length of an answer without parameters, bytes."""


class ServoAnswer(NamedTuple):
    """Valid answer of one servo."""

    status: int
    """Error bits: 1 voltage, 2 encoder, 4 temperature, 8 current, 32 overload."""
    data: bytes
    """Requested register bytes."""


class NoAnswerError(Exception):
    """No answer within the time-out, or only the echo of the request."""


class DamagedAnswerError(Exception):
    """Invalid answer: wrong header, ID, length or checksum."""


def request(servo: int, code: int, parameters: bytes = b"") -> bytes:
    """Return the bytes of one instruction."""
    body = bytes((servo, len(parameters) + 2, code)) + parameters
    return b"\xff\xff" + body + bytes((~sum(body) & 0xFF,))


def parse_answer(received: bytes, servo: int, count: int) -> ServoAnswer:
    """Parse bytes as exactly one answer of `servo` with `count` registers.

    Raises:
        NoAnswerError: `received` is empty.
        DamagedAnswerError: the bytes are not a valid answer.
    """
    if not received:
        raise NoAnswerError(f"servo {servo} is silent")
    body = received[2:]
    if len(received) != count + OVERHEAD or received[:2] != b"\xff\xff" or body[:2] != bytes((servo, count + 2)):
        raise DamagedAnswerError(f"servo {servo}: {received.hex(' ')} is not an answer with {count} registers")
    if ~sum(body[:-1]) & 0xFF != body[-1]:
        raise DamagedAnswerError(f"servo {servo}: the checksum of {received.hex(' ')} is wrong")
    return ServoAnswer(body[2], body[3:-1])


class FeetechBus:
    """Master on a bus.

    Input is dropped before each request, so that a late answer is never taken for the next one. The echo of many
    half-duplex adapters is detected and removed.
    """

    def __init__(self, transport: Transport, *, patience_s: float = PATIENCE_S) -> None:
        """Use an open byte stream at the servos' baud rate; `patience_s` is the time-out of an answer."""
        self._transport = transport
        self._patience_s = patience_s
        self.echoes: bool | None = None
        """Whether the line echoes sent bytes; None before the first request."""

    def ping(self, servo: int) -> ServoAnswer:
        """Ping a servo; raises the errors of `parse_answer`."""
        return self._ask(servo, PING, b"", 0)

    def read(self, servo: int, address: int, count: int) -> ServoAnswer:
        """Read `count` registers; raises the errors of `parse_answer`."""
        return self._ask(servo, READ, bytes((address, count)), count)

    def write(self, servo: int, address: int, data: bytes) -> ServoAnswer:
        """Write registers; raises the errors of `parse_answer`, also if acknowledgements are switched off."""
        return self._ask(servo, WRITE, bytes((address,)) + data, 0)

    def calibrate(self, servo: int) -> ServoAnswer:
        """Make a servo's present position the middle; raises the errors of `parse_answer`."""
        return self._ask(servo, CALIBRATE, b"", 0)

    def _ask(self, servo: int, code: int, parameters: bytes, count: int) -> ServoAnswer:
        if self.echoes is None:
            # A ping equals the answer with the voltage bit, so a ping cannot reveal an echo. A one-register read can:
            # its answer is shorter than the request.
            probe = request(servo, READ, b"\x03\x01")
            self.echoes = self._exchange(probe, len(probe) + OVERHEAD + 1).startswith(probe)
        sent = request(servo, code, parameters)
        received = self._exchange(sent, count + OVERHEAD + len(sent) * self.echoes)
        return parse_answer(received.removeprefix(sent) if self.echoes else received, servo, count)

    def _exchange(self, sent: bytes, size: int) -> bytes:
        self._transport.discard_input()
        self._transport.write(sent)
        return self._transport.read(size, self._patience_s)
