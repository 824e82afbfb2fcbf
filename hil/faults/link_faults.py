"""What becomes of bytes on their way, while faults of the link act on them: a pure function of time and chance.

A board writes a reply in one piece of 16 bytes, and a driver writes a command in one; faults act on such pieces.
`LinkFaults` knows nothing of ports: the emulated hand and the proxy both ask it what to send when.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Literal

Direction = Literal["to_hand", "from_hand"]
Pieces = list[tuple[float, bytes]]
"""Delays, s, and bytes."""
Passage = Callable[[bytes, float], Pieces]
"""What becomes of a piece at a time, s."""


@dataclass(frozen=True)
class LinkEffect:
    """A fault that acts on the bytes of a link."""

    fault: Hashable
    direction: Direction = "from_hand"
    passage: Passage | None = None
    """What it makes of every piece."""
    overtakes: bool = False
    """Whether the pieces that it delays may be overtaken."""
    inserts: bytes = b""
    """What comes once from nowhere."""
    silent_until: float = -1.0
    """Time (s) until which nothing comes back."""
    is_gone: bool = False
    """Whether the port is gone."""


class LinkFaults:
    """What becomes of the bytes of one link."""

    def __init__(self, fired: Callable[[Hashable], None]) -> None:
        """Begin without faults; `fired` is called with one that has an effect."""
        self._fired = fired
        self._acting: list[LinkEffect] = []
        self._free_at = {"to_hand": 0.0, "from_hand": 0.0}
        self.say: Callable[[bytes], None] = lambda _text: None
        """Sends to the host what comes from nowhere."""

    @property
    def is_idle(self) -> bool:
        """Whether no fault acts."""
        return not self._acting

    def add(self, acting: LinkEffect) -> None:
        """Let a fault act from now on."""
        if acting.inserts:
            self._fired(acting.fault)
            self.say(acting.inserts)
            return
        self._acting.append(acting)

    def remove(self, fault: Hashable) -> None:
        """Let a fault act no more."""
        self._acting = [acting for acting in self._acting if acting.fault != fault]

    def passed(self, direction: Direction, now: float, data: bytes) -> Pieces:
        """Return what of `data`, handed over at `now` (s), comes out when (s), in order."""
        if not data or (direction == "from_hand" and self._silent(now)):
            return []
        pieces, late = [(0.0, data)], False
        for acting in self._acting:
            if acting.passage is None or acting.direction != direction:
                continue
            before, pieces = pieces, []
            for delay, piece in before:
                pieces += [(delay + more, part) for more, part in acting.passage(piece, now) if part]
            if pieces != before:
                self._fired(acting.fault)
                late |= acting.overtakes
        return [(self._in_turn(direction, now + delay, late), part) for delay, part in pieces]

    def gone(self) -> bool:
        """Return whether the port is gone."""
        for acting in self._acting:
            if acting.is_gone:
                self._fired(acting.fault)
                return True
        return False

    def _in_turn(self, direction: Direction, t: float, overtaken: bool) -> float:
        if overtaken:
            return t
        self._free_at[direction] = max(self._free_at[direction], t)
        return self._free_at[direction]

    def _silent(self, now: float) -> bool:
        for acting in self._acting:
            if now < acting.silent_until:
                self._fired(acting.fault)
                return True
        return False
