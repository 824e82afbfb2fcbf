"""How late this machine and the replies are: what a person must know who reads why a hand was stopped."""

from __future__ import annotations

from collections import deque

WORTH_SAYING_S = 0.03
"""Delays below this are those of an idle machine and a healthy board, s."""


class Lateness:
    """Remembers the delays of the last `kept_s` (s): looks that began late, and replies that came late.

    Who is late differs. A look begins late because this machine was busy, or because the program did not call. A reply
    comes late because of the machine, the link or the board, and nothing tells which. No reply at all is nobody's
    lateness.
    """

    def __init__(self, kept_s: float, piece_s: float) -> None:
        """Keep delays for `kept_s`; an idle program waits in pieces of `piece_s`, so its looks begin that late (s)."""
        self._kept_s = kept_s
        self._piece_s = piece_s
        self._looks: deque[tuple[float, float]] = deque()
        self._replies: deque[tuple[float, float]] = deque()

    def began(self, t: float, late_s: float) -> bool:
        """Take a look that began at `t`, `late_s` after it was due (s); return whether that is worth saying."""
        late = late_s > self._piece_s + WORTH_SAYING_S
        self._note(self._looks, t, late_s if late else 0.0)
        return late

    def answered(self, t: float, after_s: float) -> None:
        """Take a look that was answered at `t`, `after_s` after it began (s)."""
        self._note(self._replies, t, after_s)

    def _note(self, delays: deque[tuple[float, float]], t: float, late_s: float) -> None:
        if late_s > WORTH_SAYING_S:
            delays.append((t, late_s))
        for kept in (self._looks, self._replies):
            while kept and kept[0][0] < t - self._kept_s:
                kept.popleft()

    def remark(self) -> str:
        """Return what to say about it, empty when all was in time."""
        said = ""
        if self._looks:
            worst = max(late_s for _, late_s in self._looks)
            said += f"this machine was busy or the program kept it from looking: looks began up to {worst:.2f} s late"
        if self._replies:
            worst = max(late_s for _, late_s in self._replies)
            replies = f"readings came up to {worst:.2f} s after they were asked for, because of this machine, the link "
            said += f"{'; ' if said else ''}{replies}or the board"
        return f". In the {self._kept_s:g} s before, {said}" if said else ""
