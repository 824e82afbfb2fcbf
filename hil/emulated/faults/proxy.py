"""Proxy: a pseudo-terminal in front of a port, with faults in between.

The proxy forwards the bytes of any program and any hand, a physical one too, in real time. Faults act on the pieces
that a port delivers; a piece is one reply if the hand sends 16 bytes at once.
"""

import logging
from collections.abc import Callable
from heapq import heappop, heappush
from pathlib import Path

from aero.clock import Clock, WallClock
from aero.relay import PortLine
from aero.transport import Transport
from aero_hil_terminal import Terminal
from hil.emulated.faults.link import LinkFault
from hil.emulated.faults.link_faults import LinkFaults
from hil.emulated.faults.schedule import Schedule
from hil.targets.wire_log import Direction

_LOG = logging.getLogger(__name__)
IDLE_S = 0.05
"""Longest wait between polls of `stop`, s."""


class LinkProxy:
    """Forwards bytes between a client on a pseudo-terminal and a port."""

    def __init__(
        self,
        port: Transport,
        schedule: Schedule,
        *,
        link: Path | None = None,
        clock: Clock | None = None,
    ) -> None:
        """Open the pseudo-terminal; `run` forwards the bytes.

        Args:
            port: port of the hand.
            schedule: link faults to be injected; start times count from now.
            link: path of a symbolic link to the terminal.
            clock: real-time clock; `WallClock` if None.

        Raises:
            ValueError: a fault acts elsewhere than on the link.
            FileExistsError: the link exists already.
        """
        for fault in schedule.faults:
            if not isinstance(fault.fault, LinkFault):
                raise ValueError(f"{fault} sits in the {fault.fault.layer.label}; a proxy has faults of the link only")
        self._port = port
        self._clock = clock or WallClock()
        self.now, self.random = self._clock.now, schedule.random
        self.link = LinkFaults(schedule.fire)
        self.link.say = self._answer
        self._begin = [
            (self.now() + fault.at_s, fault.fault.put(self, fault).begin)
            for fault in schedule.faults
            if isinstance(fault.fault, LinkFault)
        ]
        self._client = Terminal(link)
        self.listeners: list[Callable[[Direction, bytes], None]] = []
        """Called with the bytes of each direction as the client sends and receives them; dropped on an exception."""
        self._due: list[tuple[float, int, Callable[[bytes], None], bytes]] = []
        self._sent = 0

    @property
    def name(self) -> str:
        """Path of the terminal, as clients open it."""
        return self._client.name

    def run(self, stop: Callable[[], bool]) -> None:
        """Forward bytes until `stop()` is true or a fault removes the port.

        Raises:
            ConnectionError: the hand's port is gone.
        """
        line = PortLine(self._client, self._port)
        try:
            while not stop() and not self.link.gone():
                self._pass_on(line)
        finally:
            line.end()

    def close(self) -> None:
        """Close the terminal and remove its link; the port stays open."""
        self._client.close()

    def _pass_on(self, line: PortLine) -> None:
        now = self._clock.now()
        for begins in [begins for begins in self._begin if begins[0] <= now]:
            self._begin.remove(begins)
            begins[1]()
        due = min([now + IDLE_S, *(t for t, _ in self._begin), *(entry[0] for entry in self._due[:1])])
        from_client, from_hand = line.wait(due - now)
        if from_client:
            self._note("to_hand", from_client)
            self._send("to_hand", from_client, self._port.write)
        if from_hand:
            self._send("from_hand", from_hand, self._answer)
        while self._due and self._due[0][0] <= self._clock.now():
            _, _, write, piece = heappop(self._due)
            write(piece)

    def _answer(self, data: bytes) -> None:
        self._note("from_hand", data)
        self._client.write(data)

    def _note(self, direction: Direction, data: bytes) -> None:
        for listener in tuple(self.listeners):
            try:
                listener(direction, data)
            except Exception:  # a failing subscriber does not end the link
                self.listeners.remove(listener)
                _LOG.exception("a listener of %s failed and is dropped; the link continues", self.name)

    def _send(self, direction: Direction, data: bytes, write: Callable[[bytes], None]) -> None:
        for t, piece in self.link.passed(direction, self._clock.now(), data):
            self._sent += 1
            heappush(self._due, (t, self._sent, write, piece))
