"""The link between an emulated board and its host, with somebody who hears what the board says."""

from collections import deque

REMEMBERED_S = 10.0
"""For how long it is known what the board has sent, s: longer than any exchange but homing."""


class OverheardLine:
    """The link between board and host: faults act on it, and what the board has sent is overheard before they do."""

    is_idle = False

    def __init__(self):
        self.faults, self.sent, self._free_at = None, deque(), {"to_hand": 0.0, "from_hand": 0.0}

    def passed(self, direction, now, data):
        """Return (time, bytes) of what arrives; the order is kept when faults change."""
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
