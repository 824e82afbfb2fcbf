"""Encoder and stream parser of Feetech SCS packets, independent of time and servos.

`FF FF id length code parameters... checksum`, length = number of parameters + 2, checksum = inverted low byte of the
sum from id to the last parameter. The code is an instruction on the way out and an error byte on the way back.
Source: FTServo_Arduino v2.0.0 (64922cd), `SCS.cpp`.
"""

from enum import IntEnum
from functools import lru_cache
from typing import NamedTuple

BROADCAST = 0xFE
HEADER = b"\xff\xff"


class Instruction(IntEnum):
    """Instruction codes of the HLS series."""

    PING = 0x01
    READ = 0x02
    WRITE = 0x03
    REG_WRITE = 0x04
    ACTION = 0x05
    RESTORE = 0x06
    REBOOT = 0x08
    RESET = 0x0A
    CALIBRATE = 0x0B
    SYNC_READ = 0x82
    SYNC_WRITE = 0x83


class Packet(NamedTuple):
    """One well-formed packet."""

    servo: int
    """ID, 0..253, or 254 for all."""
    code: int
    """Instruction, or the error byte of a status packet."""
    parameters: bytes
    """Bytes after the code, without the checksum."""


def pack(servo: int, code: int, parameters: bytes = b"") -> bytes:
    """Return the bytes of one packet."""
    head, total = _head(servo, len(parameters) + 2, code)
    return head + parameters + _CHECKSUMS[(total + sum(parameters)) & 0xFF]


@lru_cache(maxsize=512)
def _head(servo: int, length: int, code: int) -> tuple[bytes, int]:
    """Return the bytes before the parameters and their contribution to the checksum."""
    body = bytes((servo, length, code))
    return HEADER + body, sum(body)


_CHECKSUMS = [bytes((~total & 0xFF,)) for total in range(256)]
"""Checksum byte, indexed by the low byte of the sum."""


class PacketParser:
    """Parser of a byte stream into instruction packets, modelled on a servo's receiver.

    Bytes before a header are skipped. After a wrong checksum the search continues behind the header, so that a good
    packet after a damaged one is still found. At most one partial packet is buffered.
    """

    def __init__(self) -> None:
        self._pending = b""
        self._whole: dict[bytes, Packet] = {}

    @property
    def has_begun(self) -> bool:
        """Whether a partial packet is buffered."""
        return bool(self._pending)

    def clear(self) -> None:
        """Drop a partial packet, as a servo does after a silence on the line."""
        self._pending = b""

    def feed(self, data: bytes) -> list[tuple[int, Packet]]:
        """Parse bytes; return the completed packets, each with the number of bytes of `data` up to its end."""
        if not self._pending and (known := self._whole.get(data)) is not None:
            return [(len(data), known)]
        pending = self._pending + data
        carried = len(self._pending)
        found: list[tuple[int, Packet]] = []
        at = 0
        while (start := pending.find(HEADER, at)) >= 0:
            # A third FF in a row is still header: the id cannot be 255.
            if len(pending) > start + 2 and pending[start + 2] == 0xFF:
                at = start + 1
                continue
            if len(pending) < start + 4:
                break
            length = pending[start + 3]
            end = start + 4 + length
            if length < 2:
                at = start + 2
            elif len(pending) < end:
                break
            elif ~sum(pending[start + 2 : end - 1]) & 0xFF != pending[end - 1]:
                at = start + 2
            else:
                packet = Packet(pending[start + 2], pending[start + 4], pending[start + 5 : end - 1])
                found.append((end - carried, packet))
                at = end
        if start < 0:
            start = len(pending) - 1 if pending.endswith(b"\xff") and len(pending) > at else len(pending)
        self._pending = pending[max(start, at) :]
        if len(found) == 1 and carried == 0 and found[0][0] == len(data):
            self._remember(data, found[0][1])
        return found

    def _remember(self, data: bytes, packet: Packet) -> None:
        # The firmware repeats few distinct packets; parsing each once keeps the telemetry cycle fast.
        if len(self._whole) >= 64:
            self._whole.clear()
        self._whole[data] = packet
