"""Which requests may still be answered, so that no reply is taken for that to another request.

Theory of operation
===================

A reply carries an opcode and no number, so two requests of one kind cannot be told by their replies. Five rules make
up for it.

Rule 1: replies come in the order of their requests. A reply settles every older request: it was answered before, or
never will be. So a request of a kind for which none is waiting has a reply that is certainly its own.

Rule 2: a reply of a kind for which several requests wait belongs to the oldest of them. That may be wrong, but errs on
the safe side: too many requests are taken to be waiting, never too few.

Rule 3: what a link is silent about is found out with queries of one kind, `probe`. Its first reply already settles
what was asked before the first of them, so a link that is well again is found with one probe, or two.

Rule 4: a link that lets replies overtake each other breaks rule 1. For `LATE_S` after a request whose turn has passed,
a reply of its kind may be that old one; then the request is made twice and the replies are compared.

Rule 5: some links get one request at a time: one that held a reply for more than `HELD_S` and has lost nothing since,
and one that ever let a reply overtake another. Then nothing can overtake, and no probe can be held. Other links are
probed at once (rule 3), such a link only after `LATE_S`.

A restart of the board changes nothing of this. What it drops will never be answered, and what is asked after it must
not be forgotten because its boot text comes late.
"""

from __future__ import annotations

from collections import deque
from math import inf

from aero.protocol import FILLER, FRAME_SIZE, READINGS, Opcode

HELD_BACK_S = 10.0
"""Longest time for which a link is taken to hold replies back in their order, s; a request that is older is lost."""
LATE_S = 3.3
"""Longest time from a request to its reply, s, up to which replies are not confused: 3 s promised, 0.3 s margin."""
HELD_S = 1.0
"""Age of a reply, s; above it the link is known to hold replies back. A busy machine is late by 0.9 s."""
ROUNDING_S = 1e-9
"""Tolerance for comparing sums of waiting times, s."""


class Overdue:
    """Requests that may still be answered, oldest first."""

    def __init__(self) -> None:
        self._waiting: deque[tuple[Opcode, float]] = deque()
        self._passed: dict[Opcode, float] = {}
        """When the last request of a kind was sent whose turn has passed, s."""
        self._slow = False
        self._overtakes = False

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
    def one_at_a_time(self) -> bool:
        """Whether the link holds replies back or lets them overtake (rule 5)."""
        return self._slow or self._overtakes

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

    def answered(self, opcode: Opcode, t: float) -> None:
        """Take a reply at `t` (s): what was asked before it has been answered, or never will be."""
        if opcode not in self:
            return
        held = self._waiting[0][0] is opcode and t - max(asked for waiting, asked in self._waiting if waiting is opcode)
        while self._waiting[0][0] is not opcode:
            self._pass()
        self._waiting.popleft()
        self._slow |= held > HELD_S

    def unasked(self, data: bytes, t: float) -> None:
        """Take bytes at `t` (s) that no request waits for: they may be replies that others have overtaken."""
        for at in range(0, len(data) - FRAME_SIZE + 1, FRAME_SIZE):
            old = [query for query in self._passed if data[at : at + 2] == bytes((query, FILLER))]
            self._overtakes |= any(self.may_be_older(query, t) for query in old)

    def settle(self, before: float) -> None:
        """Take it that what was sent before a time (s) has been answered, or never will be."""
        while self._waiting and self._waiting[0][1] < before:
            self._pass()

    def _pass(self) -> None:
        opcode, t = self._waiting.popleft()
        self._passed[opcode] = t
        self._slow = False

    def may_be_older(self, opcode: Opcode, t: float) -> bool:
        """Return whether a reply at `t` (s) may be that to a request whose turn has passed."""
        return t - self._passed.get(opcode, -inf) < LATE_S - ROUNDING_S

    def wait_until(self, opcode: Opcode, t: float) -> float | None:
        """Return the end of the time of mere waiting (rule 5), s; None if a request may go out at `t`."""
        if not self.one_at_a_time:
            return None
        until = LATE_S + max(self._waiting[0][1] if self._waiting else -inf, self._passed.get(opcode, -inf))
        return until if t < until - ROUNDING_S else None

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
