"""Which requests may still be answered, so that no reply is taken for that to another request.

Theory of operation
===================

A reply carries an opcode and no number, so two requests of one kind cannot be told by their replies. Four rules make
up for it.

Rule 1: replies come in the order of their requests. A reply settles every older request: it was answered before, or
never will be. So a request of a kind for which none is waiting has a reply that is certainly its own.

Rule 2: a reply of a kind for which several requests wait belongs to the oldest of them. That may be wrong, but errs on
the safe side: too many requests are taken to be waiting, never too few.

Rule 3: what a link is silent about is found out with queries of one kind, `probe`. Its first reply already settles
what was asked before the first of them, so a link that is well again is found with one probe, or two.

Rule 4: a link that lets replies overtake each other breaks rule 1. For `OVERTAKEN_S` after a request whose turn has
passed, a reply of its kind may be that old one; then the request is made twice and the replies are compared.

A restart of the board changes nothing of this. What it drops will never be answered, and what is asked after it must
not be forgotten because its boot text comes late.
"""

from __future__ import annotations

from collections import deque
from math import inf

from aero.protocol import FILLER, READINGS, Opcode

HELD_BACK_S = 10.0
"""Longest time for which a link is taken to hold replies back in their order, s; a request that is older is lost."""
OVERTAKEN_S = 2.0
"""Longest time by which a reply is taken to come after later ones, s, counted from its request."""


class Overdue:
    """Requests that may still be answered, oldest first."""

    def __init__(self) -> None:
        self._waiting: deque[tuple[Opcode, float]] = deque()
        self._passed: dict[Opcode, float] = {}
        """When the last request of a kind was sent whose turn has passed, s."""

    def __contains__(self, opcode: Opcode) -> bool:
        """Whether a reply to an `opcode` may still come in its turn."""
        return opcode in [waiting for waiting, _ in self._waiting]

    def __bool__(self) -> bool:
        """Whether any reply may still come."""
        return bool(self._waiting)

    @property
    def opcodes(self) -> tuple[Opcode, ...]:
        """What they asked for."""
        return tuple([opcode for opcode, _ in self._waiting])

    @property
    def latest(self) -> float:
        """When the last of them was sent, s; long ago if there is none."""
        return self._waiting[-1][1] if self._waiting else -inf

    def count(self, opcode: Opcode, since: float) -> int:
        """Return how many `opcode` wait that were sent after a time (s)."""
        return sum(waiting is opcode and t >= since for waiting, t in self._waiting)

    def sent(self, opcode: Opcode, t: float) -> None:
        """Take a request sent at `t` (s)."""
        while self._waiting and self._waiting[0][1] < t - HELD_BACK_S:
            self._waiting.popleft()
        self._waiting.append((opcode, t))

    def answered(self, opcode: Opcode) -> None:
        """Take a reply: what was asked before it has been answered, or never will be."""
        if opcode in self:
            while self._waiting[0][0] is not opcode:
                self._pass()
            self._waiting.popleft()

    def settle(self, before: float) -> None:
        """Take it that what was sent before a time (s) has been answered, or never will be."""
        while self._waiting and self._waiting[0][1] < before:
            self._pass()

    def _pass(self) -> None:
        opcode, t = self._waiting.popleft()
        self._passed[opcode] = t

    def may_be_older(self, opcode: Opcode, t: float) -> bool:
        """Return whether a reply at `t` (s) may be that to a request whose turn has passed."""
        return t - self._passed.get(opcode, -inf) < OVERTAKEN_S

    def may_start(self, data: bytes) -> bool:
        """Return whether bytes can be the beginning of one of these replies."""
        return any(bytes((opcode, FILLER)).startswith(data[:2]) for opcode, _ in self._waiting)

    def probe(self, wanted: Opcode) -> Opcode:
        """Return the query of another kind whose reply settles most of what is waiting, and can least be an old one."""
        oldest = {opcode: -place for place, opcode in enumerate(reversed(self.opcodes))}
        return max(
            (query for query in READINGS if query is not wanted),
            key=lambda query: (oldest.get(query, 1), -self._passed.get(query, -inf)),
        )
