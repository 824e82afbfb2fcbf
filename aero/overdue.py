"""Bookkeeping of unanswered requests, so that a reply is matched to its own request.

Theory of operation
===================

A reply carries an opcode but no sequence number, so replies to two requests with one opcode look alike. Five rules
resolve the ambiguity.

Rule 1: replies arrive in the order of their requests. A reply settles every older request, as answered or lost. If no
other request with its opcode is pending, a reply belongs to its request for certain.

Rule 2: with several pending requests of one opcode, a reply counts for the oldest. This assumption is conservative: it
may leave too many requests pending, never too few.

Rule 3: after silence, queries of one other opcode (`probe`) show whether earlier requests are lost. The first reply
settles all requests before the first probe, so a recovered link needs one probe or two.

Rule 4: a link that reorders replies violates rule 1. For `LATE_S` after a request that was settled without a reply, a
reply with its opcode may be the old one; the request is then sent twice and the replies are compared.

Rule 5: some links get one request at a time: a link that delayed a reply by more than `HELD_S` and has lost none since,
and a link that has ever reordered replies. One request cannot be reordered, and no probe can be delayed behind it.
Other links are probed at once (rule 3), such a link only after `LATE_S`.

A restart of the board does not clear the pending requests. Dropped requests remain unanswered, and requests sent after
the restart must not be cleared by late boot text.
"""

from collections import deque
from math import inf

from aero.protocol import FILLER, FRAME_SIZE, READINGS, Opcode

HELD_BACK_S = 10.0
"""Longest assumed delay of a reply in its order, s; older requests count as lost."""
LATE_S = 3.3
"""Longest delay of a reply, s, up to which replies are never confused: 3 s promised, 0.3 s margin."""
HELD_S = 1.0
"""Threshold of a reply's delay, s; above it the link counts as delaying. A busy computer is up to 0.9 s late."""
ROUNDING_S = 1e-9
"""Tolerance for comparing sums of waiting times, s."""


class Overdue:
    """Requests that may still be answered, oldest first."""

    def __init__(self) -> None:
        self._waiting: deque[tuple[Opcode, float]] = deque()
        self._passed: dict[Opcode, float] = {}
        """Send time of the last request settled without a reply, by opcode, s."""
        self._slow = False
        self._overtakes = False

    def __contains__(self, opcode: Opcode) -> bool:
        """Return whether a request with `opcode` is pending."""
        return opcode in [waiting for waiting, _ in self._waiting]

    def __bool__(self) -> bool:
        """Return whether any request is pending."""
        return bool(self._waiting)

    @property
    def opcodes(self) -> tuple[Opcode, ...]:
        """Opcodes of the pending requests, oldest first."""
        return tuple([opcode for opcode, _ in self._waiting])

    @property
    def one_at_a_time(self) -> bool:
        """True for a link that delays or reorders replies (rule 5)."""
        return self._slow or self._overtakes

    @property
    def latest(self) -> float:
        """Send time of the newest pending request, s; -inf without one."""
        return self._waiting[-1][1] if self._waiting else -inf

    def count(self, opcode: Opcode, since: float) -> int:
        """Return the number of pending requests with `opcode` sent since a time (s)."""
        return sum(waiting is opcode and t >= since for waiting, t in self._waiting)

    def sent(self, opcode: Opcode, t: float) -> None:
        """Record a request sent at `t` (s)."""
        while self._waiting and self._waiting[0][1] < t - HELD_BACK_S:
            self._waiting.popleft()
        self._waiting.append((opcode, t))

    def answered(self, opcode: Opcode, t: float) -> None:
        """Record a reply at `t` (s), which settles all older requests."""
        if opcode not in self:
            return
        held = self._waiting[0][0] is opcode and t - max(asked for waiting, asked in self._waiting if waiting is opcode)
        while self._waiting[0][0] is not opcode:
            self._pass()
        self._waiting.popleft()
        self._slow |= held > HELD_S

    def unasked(self, data: bytes, t: float) -> None:
        """Check unsolicited bytes at `t` (s) for reordered replies."""
        for at in range(0, len(data) - FRAME_SIZE + 1, FRAME_SIZE):
            old = [query for query in self._passed if data[at : at + 2] == bytes((query, FILLER))]
            self._overtakes |= any(self.may_be_older(query, t) for query in old)

    def settle(self, before: float) -> None:
        """Settle all requests sent before a time (s)."""
        while self._waiting and self._waiting[0][1] < before:
            self._pass()

    def _pass(self) -> None:
        opcode, t = self._waiting.popleft()
        self._passed[opcode] = t
        self._slow = False

    def may_be_older(self, opcode: Opcode, t: float) -> bool:
        """Return whether a reply at `t` (s) may belong to a request already settled (rule 4)."""
        return t - self._passed.get(opcode, -inf) < LATE_S - ROUNDING_S

    def wait_until(self, opcode: Opcode, t: float) -> float | None:
        """Return the time, s, until which no request may be sent (rule 5); None if one may be sent at `t`."""
        if not self.one_at_a_time:
            return None
        until = LATE_S + max(self._waiting[0][1] if self._waiting else -inf, self._passed.get(opcode, -inf))
        return until if t < until - ROUNDING_S else None

    def may_start(self, data: bytes) -> bool:
        """Return whether `data` can be the start of a pending reply."""
        return any(bytes((opcode, FILLER)).startswith(data[:2]) for opcode, _ in self._waiting)

    def probe(self, wanted: Opcode) -> Opcode:
        """Return the query other than `wanted` that settles most pending requests and is least likely an old reply."""
        oldest = {opcode: -place for place, opcode in enumerate(reversed(self.opcodes))}
        return max(
            (query for query in READINGS if query is not wanted),
            key=lambda query: (oldest.get(query, 1), -self._passed.get(query, -inf)),
        )
