"""One port for two users: a client, whose frames pass in whole, and the guard, whose queries go in between.

The board answers in the order of the requests, so the next reply belongs to the earliest pending request of its opcode.
Requests before that one are answered no more. Bytes outside replies, such as boot text, go to both users.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from aero.clock import Clock
from aero.protocol import FILLER, FRAME_SIZE, Opcode
from aero.relay import GuardedLine

ANSWERED = frozenset({*Opcode} - {Opcode.CTRL_POS, Opcode.CTRL_TOR})
CUT_S = 0.1
"""Longest pause within a reply, s; after it the rest counts as lost."""
LATEST_S = 5.0
"""Longest time from a request to its reply, s, except of homing."""
Screen = Callable[[bytes], bytes | None]


class Request(NamedTuple):
    """Request whose reply is pending."""

    t: float
    """Send time, clock s."""
    opcode: int
    ours: bool
    """True for a request of the guard."""


class SharedPort:
    """Port of a hand, shared by a client and a guard.

    Whoever waits on it passes the bytes of the other user on: `pump`, a read of `guards_end`, a wait on its clock.
    """

    def __init__(self, line: GuardedLine, clock: Clock, name: str, screen: Screen) -> None:
        """Share a line.

        Args:
            line: line between the client and the hand.
            clock: clock of the hand.
            name: display name of the port.
            screen: returns the frame to send for a frame of the client, or None to drop it.
        """
        self._line, self._clock, self._screen = line, clock, screen
        self.guards_end = GuardsEnd(self, clock, name)
        self.listeners: list[Callable[[bool, bytes], None]] = []
        """Called with True and bytes to the hand, with False and bytes from it."""
        self._pending: deque[Request] = deque()
        self._unfinished = bytearray()
        self._received = bytearray()
        self._rest, self._ours = 0, False
        self._arrived_at = clock.now()

    def pump(self, until: float) -> None:
        """Wait for bytes until `until` (clock s) at most, and pass them on.

        Raises:
            ConnectionError: the port is gone.
        """
        from_client, from_hand = self._line.wait(max(0.0, until - self._clock.now()))
        if from_hand:
            self._note(False, from_hand)
            self._deliver(from_hand)
        if from_client:
            self._pass_on(from_client)

    def send(self, data: bytes, *, ours: bool) -> None:
        """Send bytes to the hand, and expect the reply to a request."""
        if data[0] in ANSWERED and len(data) == FRAME_SIZE:
            self._pending.append(Request(self._clock.now(), data[0], ours))
        self._note(True, data)
        self._line.to_port(data)

    def awaits(self, opcode: Opcode) -> bool:
        """Return whether the client's request with this opcode is unanswered."""
        return any(one.opcode == opcode and not one.ours for one in self._pending)

    def drop_unfinished(self) -> None:
        """Drop a frame that the client has not completed, as after its end."""
        self._unfinished.clear()

    def close(self) -> None:
        """Release the port."""
        self._line.close()

    def _pass_on(self, data: bytes) -> None:
        """Pass the client's whole frames on, in one write: a board never finds the start of a frame again."""
        self._unfinished += data
        while len(self._unfinished) >= FRAME_SIZE:
            frame = bytes(self._unfinished[:FRAME_SIZE])
            del self._unfinished[:FRAME_SIZE]
            if (passed := self._screen(frame)) is not None:
                self.send(passed, ours=False)

    def _deliver(self, data: bytes) -> None:
        now = self._clock.now()
        if now - self._arrived_at > CUT_S:
            self._rest = 0
        self._arrived_at = now
        self._received += data
        stray = bytearray()
        while self._received and (self._rest or not self._undecided()):
            if not self._rest and not self._begins(now):
                stray += self._taken(1)
                continue
            self._hand_over_stray(stray)
            piece = self._taken(self._rest)
            self._rest -= len(piece)
            (self.guards_end.receive if self._ours else self._line.to_client)(piece)
        self._hand_over_stray(stray)

    def _begins(self, now: float) -> bool:
        """Return whether a pending reply begins here, and expect the whole of it."""
        if len(self._received) < 2 or self._received[1] != FILLER:
            return False
        for place, one in enumerate(self._pending):
            late = now - one.t > LATEST_S and one.opcode != Opcode.HOMING
            if one.opcode == self._received[0] and not late:
                for _ in range(place + 1):
                    self._pending.popleft()
                self._rest, self._ours = FRAME_SIZE, one.ours
                return True
        return False

    def _undecided(self) -> bool:
        """Return whether the next byte shows whether a pending reply begins here."""
        return len(self._received) == 1 and any(one.opcode == self._received[0] for one in self._pending)

    def _taken(self, count: int) -> bytes:
        piece = bytes(self._received[:count])
        del self._received[:count]
        return piece

    def _hand_over_stray(self, stray: bytearray) -> None:
        if stray:
            self._line.to_client(bytes(stray))
            self.guards_end.receive(bytes(stray))
            stray.clear()

    def _note(self, to_hand: bool, data: bytes) -> None:
        for listener in self.listeners:
            listener(to_hand, data)


class GuardsEnd:
    """`Transport` and `Clock` of the guard on a shared port; its waits pass the client's bytes on."""

    def __init__(self, port: SharedPort, clock: Clock, name: str) -> None:
        self.name = name
        """Name of the port."""
        self._port, self._clock = port, clock
        self._received = bytearray()

    def receive(self, data: bytes) -> None:
        """Add bytes for the guard."""
        self._received += data

    def write(self, data: bytes) -> None:
        """Send all of `data`; see `Transport.write`."""
        if data:
            self._port.send(bytes(data), ours=True)

    def read(self, size: int, timeout: float) -> bytes:
        """Return up to `size` bytes within `timeout` (s); see `Transport.read`."""
        deadline = self._clock.now() + timeout
        while len(self._received) < size:
            self._port.pump(deadline)
            if self._clock.now() >= deadline:
                break
        data = bytes(self._received[:size])
        del self._received[:size]
        return data

    def discard_input(self) -> None:
        """Drop all received bytes of the guard."""
        self._received.clear()

    def close(self) -> None:
        """Do nothing: the port is the relay's."""

    def now(self) -> float:
        """Return the time in s."""
        return self._clock.now()

    def sleep_until(self, t: float) -> None:
        """Wait until `now()` is at least `t` (s), and pass bytes on meanwhile."""
        while self._clock.now() < t:
            self._port.pump(t)
