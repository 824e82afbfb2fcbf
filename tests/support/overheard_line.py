"""Link between an emulated board and its host, with a record of the board's output before link faults."""

from collections import deque

REMEMBERED_S = 10.0
"""Retention of the board's output, s; longer than any exchange except homing."""


class OverheardLine:
    """Link between board and host with faults, and a record of the board's output before the faults."""

    is_idle = False

    def __init__(self):
        self.faults, self.sent, self._free_at = None, deque(), {"to_hand": 0.0, "from_hand": 0.0}

    def passed(self, direction, now, data):
        """Return (time, bytes) of the arriving pieces; the order is kept when faults change."""
        if direction == "from_hand":
            self.sent.append((now, data))
            while self.sent[0][0] < now - REMEMBERED_S:
                self.sent.popleft()
        pieces = [(now, data)] if self.faults is None else self.faults.passed(direction, now, data)
        arrivals = []
        for t, piece in pieces:
            self._free_at[direction] = max(self._free_at[direction], t)
            arrivals.append((self._free_at[direction], piece))
        return arrivals
