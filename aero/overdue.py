"""Which requests may still be answered. Replies carry no number, but they come in the order of their requests."""

from __future__ import annotations

from collections import deque

from aero.protocol import FILLER, READINGS, Opcode

HELD_BACK_S = 2.0
"""Longest time for which a link is taken to hold a reply back, s; a request that is older is lost. Twice what a virtual
machine's core was seen asleep."""


class Overdue:
    """Requests without a reply, oldest first."""

    def __init__(self) -> None:
        self._waiting: deque[tuple[Opcode, float]] = deque()

    def __contains__(self, opcode: Opcode) -> bool:
        """Whether a reply to an `opcode` may still come."""
        return any(waiting is opcode for waiting, _ in self._waiting)

    @property
    def opcodes(self) -> tuple[Opcode, ...]:
        """What they asked for; no opcode twice, if none was sent while it was in here."""
        return tuple(opcode for opcode, _ in self._waiting)

    def sent(self, opcode: Opcode, t: float) -> None:
        """Take a request sent at `t` (s)."""
        self._waiting.append((opcode, t))

    def answered(self, opcode: Opcode) -> None:
        """Take a reply: what was asked before it has been answered, or never will be."""
        if opcode in self:
            while self._waiting.popleft()[0] is not opcode:
                pass

    def may_start(self, data: bytes) -> bool:
        """Return whether bytes can be the beginning of one of these replies."""
        return any(bytes((opcode, FILLER)).startswith(data[:2]) for opcode, _ in self._waiting)

    def forget(self, before: float = float("inf")) -> None:
        """Give up requests that were sent before a time (s); all of them when the board restarted."""
        while self._waiting and self._waiting[0][1] < before:
            self._waiting.popleft()

    def distinct(self) -> Opcode | None:
        """Return a query whose reply cannot be taken for one that is still to come; None when there is none left."""
        return next((opcode for opcode in READINGS if opcode not in self), None)
