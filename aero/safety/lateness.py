"""How late this machine is: what a person must know who reads why a hand was stopped."""

from __future__ import annotations

from collections import deque

WORTH_SAYING_S = 0.03
"""Delays below this are an idle machine's, s."""


class Lateness:
    """Remembers the delays of the last `kept_s` (s)."""

    def __init__(self, kept_s: float) -> None:
        self._kept_s = kept_s
        self._delays: deque[tuple[float, float]] = deque()

    def note(self, t: float, late_s: float) -> None:
        """Take a delay `late_s` (s) that ended at `t` (s)."""
        if late_s > WORTH_SAYING_S:
            self._delays.append((t, late_s))
        while self._delays and self._delays[0][0] < t - self._kept_s:
            self._delays.popleft()

    def remark(self) -> str:
        """Return a sentence about it, empty when this machine was in time."""
        if not self._delays:
            return ""
        worst = max(late_s for _, late_s in self._delays)
        return (
            f". In the {self._kept_s:g} s before, this machine was busy or the program kept it from looking: readings "
            f"came up to {worst:.2f} s late"
        )
