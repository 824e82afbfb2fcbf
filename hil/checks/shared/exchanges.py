"""Requests and replies, taken apart from the bytes on the wire."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from aero.protocol import FILLER, FRAME_SIZE, Opcode
from hil.targets.wire_log import WireRecord

MEASUREMENTS = range(0x22, 0x26)
"""Opcodes of requests that the board answers with one frame, at once."""
UNANSWERED = {Opcode.CTRL_POS, Opcode.CTRL_TOR}
"""Requests that are not answered."""


@dataclass
class Exchange:
    """A frame that was sent, and everything that came before the next one."""

    t: float
    """When it was sent, s."""
    frame: bytes
    opcode: int
    """What was asked."""
    received: bytes = b""
    times: list[float] = field(default_factory=list)
    """When the pieces of that came, s."""
    completed: float | None = None
    """When there was one whole reply, s."""


def exchanges(wire: Iterable[WireRecord]) -> list[Exchange]:
    """Return the exchanges in order; what came before the first is left out."""
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
    """Return how many whole replies came when none was due any more, as of a link that doubles them."""
    surplus = due = 0
    for exchange in made:
        due += exchange.opcode not in UNANSWERED
        frames = len(exchange.received) // FRAME_SIZE
        surplus += max(0, frames - due)
        # Replies come in the order of their requests.
        last = exchange.received[FRAME_SIZE * (frames - 1) : FRAME_SIZE * frames]
        due = 0 if last[:1] == bytes((exchange.opcode,)) else max(0, due - frames)
    return surplus


def lost_replies(made: Iterable[Exchange]) -> int:
    """Return how many requests for a measurement were never answered.

    A reply that came late, after another request, is none of them: the host may have been busy. Replies come in the
    order of their requests, so one to a later request shows that the earlier ones were lost. One with the opcode of a
    request that is not waiting answers none.
    """
    lost = 0
    overdue: list[int] = []
    for exchange in made:
        data = exchange.received
        while len(data) >= FRAME_SIZE and data[1] == FILLER and data[0] in overdue:
            lost += overdue.index(data[0])
            del overdue[: overdue.index(data[0]) + 1]
            data = data[FRAME_SIZE:]
        if exchange.opcode not in MEASUREMENTS:
            continue
        if len(data) >= FRAME_SIZE:
            lost += len(overdue) + (data[0] != exchange.opcode)
            overdue.clear()
        else:
            overdue.append(exchange.opcode)
    return lost + len(overdue)
