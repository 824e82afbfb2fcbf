"""Requests and replies, parsed from the bytes on the wire."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from aero.protocol import FRAME_SIZE, Opcode
from hil.targets.wire_log import WireRecord

MEASUREMENTS = range(0x22, 0x26)
"""Opcodes of requests that the board answers with one frame at once."""
UNANSWERED = {Opcode.CTRL_POS, Opcode.CTRL_TOR}


@dataclass
class Exchange:
    """Sent frame, with all bytes received before the next one."""

    t: float
    """Time of sending, s."""
    frame: bytes
    opcode: int
    received: bytes = b""
    times: list[float] = field(default_factory=list)
    """Arrival times of the chunks in `received`, s."""
    completed: float | None = None
    """Time at which one whole reply had arrived, s."""


def exchanges(wire: Iterable[WireRecord]) -> list[Exchange]:
    """Return the exchanges in order, without bytes before the first."""
    found: list[Exchange] = []
    for record in wire:
        if record.direction == "to_hand":
            found.append(Exchange(record.t, record.data, record.data[0]))
        elif found:
            found[-1].received += record.data
            found[-1].times.append(record.t)
            if len(found[-1].received) == FRAME_SIZE:
                found[-1].completed = record.t
    return found


def surplus_frames(made: Iterable[Exchange]) -> int:
    """Return the number of whole replies without an open request, as on a link that duplicates replies."""
    surplus = due = 0
    for exchange in made:
        due += exchange.opcode not in UNANSWERED
        frames = len(exchange.received) // FRAME_SIZE
        surplus += max(0, frames - due)
        # replies arrive in the order of their requests
        last = exchange.received[FRAME_SIZE * (frames - 1) : FRAME_SIZE * frames]
        due = 0 if last[:1] == bytes((exchange.opcode,)) else max(0, due - frames)
    return surplus
