"""Effect of link faults on bytes in transit, as a pure function of time and random numbers.

A board writes a reply as one piece of 16 bytes, a driver a command as one piece; faults act on pieces.
`LinkFaults` does no I/O: the emulated hand and the proxy send the pieces it returns.
"""

from collections.abc import Callable, Hashable
from dataclasses import dataclass

from hil.targets.wire_log import Direction

Pieces = list[tuple[float, bytes]]
"""Pairs of delay, s, and bytes."""
Passage = Callable[[bytes, float], Pieces]
"""Maps a piece and a time, s, to the pieces to be sent."""


@dataclass(frozen=True)
class LinkEffect:
    """Effect of a fault on the bytes of a link."""

    fault: Hashable
    direction: Direction = "from_hand"
    passage: Passage | None = None
    overtakes: bool = False
    """True if later pieces may overtake a delayed one."""
    inserts: bytes = b""
    """Unsolicited bytes, sent to the host once."""
    silent_until: float = -1.0
    """End of a silence of the hand, s."""
    is_gone: bool = False
    """True if the port has disappeared."""


class LinkFaults:
    """Active faults of one link."""

    def __init__(self, fired: Callable[[Hashable], None]) -> None:
        """Start without faults; `fired` is called with each fault that has an effect."""
        self._fired = fired
        self._acting: list[LinkEffect] = []
        self._free_at = {"to_hand": 0.0, "from_hand": 0.0}
        self.say: Callable[[bytes], None] = lambda _text: None
        """Sends unsolicited bytes to the host."""

    @property
    def is_idle(self) -> bool:
        """True if no fault is active."""
        return not self._acting

    def add(self, acting: LinkEffect) -> None:
        """Activate a fault, or send the bytes that it inserts."""
        if acting.inserts:
            self._fired(acting.fault)
            self.say(acting.inserts)
            return
        self._acting.append(acting)

    def remove(self, fault: Hashable) -> None:
        """Deactivate a fault."""
        self._acting = [acting for acting in self._acting if acting.fault != fault]

    def passed(self, direction: Direction, now: float, data: bytes) -> Pieces:
        """Return the send times, s, and pieces of `data` that was handed over at `now`, s."""
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
        """Return True if a fault has removed the port."""
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
