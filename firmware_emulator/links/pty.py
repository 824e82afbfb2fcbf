"""Real-time server of an emulated hand: the board and, optionally, the raw servo bus.

A loop runs the kernel of virtual time up to the wall clock whenever an event is due or bytes arrive. Bytes enter at the
instant of their detection, which `listeners` receive: replaying them at these instants on virtual time gives equal
answers.
"""

import logging
import select
import time
from collections.abc import Callable, Collection
from contextlib import ExitStack
from pathlib import Path
from typing import Literal, Protocol

from aero_hil_terminal import Terminal
from firmware_emulator.bus import ServoBus
from firmware_emulator.firmware.setup_and_loop import ResetCause
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.kernel import Kernel
from firmware_emulator.links import Closing
from firmware_emulator.links.in_process import WireEntry
from firmware_emulator.links.network import NetworkPort
from firmware_emulator.links.serial_port import SerialPort

_LOG = logging.getLogger(__name__)
REENUMERATES: frozenset[ResetCause] = frozenset({"power_on", "brown_out"})
"""Resets after which the USB port disappears and re-enumerates (assumption)."""
ENUMERATION_S = 0.5
"""Duration of the USB re-enumeration, s (assumption; a Linux host needs 0.3 to 1 s)."""
IDLE_S = 0.05
"""Longest wait between checks of `stop`, s."""
POLLED_S = 0.0004
"""Wait below which the loop polls instead of sleeping, s: Linux wakes a sleeper about 0.07 ms late."""


class End(Protocol):
    """Device end of a terminal or port."""

    def fileno(self) -> int:
        """Return the descriptor to wait on."""
        ...

    def read(self) -> bytes:
        """Return the received bytes."""
        ...

    def close(self) -> None:
        """Close this end; a second call does nothing."""


BusEnd = Terminal | SerialPort


def put_on_bus(bus: ServoBus, end: BusEnd) -> Callable[[bytes], object]:
    """Connect a terminal or port to a servo bus as a master; return the sink for its received bytes."""
    port = bus.connect(end.write)

    def take(data: bytes) -> None:
        port.baud = end.baud
        port.write(data)

    return take


def serve(
    kernel: Kernel,
    ends: Collection[End],
    take: Callable[[End], object],
    stop: Callable[[], bool],
    *,
    after: Callable[[], object] = lambda: None,
    on_late: Callable[[float], object] = lambda _late_s: None,
) -> None:
    """Run a kernel in step with the wall clock until `stop()`, polled at least every 50 ms, returns true.

    Args:
        kernel: event kernel of the served hand or bus.
        ends: ends to read from; may change during the call.
        take: called with an end that has unread bytes, with the kernel at the present instant.
        stop: returns whether to end.
        after: called after each turn of the loop.
        on_late: called with the delay (s) when the kernel runs behind schedule.
    """
    start = time.monotonic() - kernel.now
    while not stop():
        due = kernel.next_event()
        idle = IDLE_S if due is None else min(max(start + due - time.monotonic(), 0.0), IDLE_S)
        ready, _, _ = select.select(list(ends), [], [], idle if idle > POLLED_S else 0.0)
        late_s = time.monotonic() - start - due if due is not None else 0.0
        if late_s > 0.0:
            on_late(late_s)
        kernel.run_until(time.monotonic() - start)
        for end in ready:
            take(end)
        after()


class PtyServer(Closing):
    """Server of an emulated hand on a pseudo-terminal, and of its servo bus on another one or on a serial port."""

    def __init__(
        self,
        electronics: EmulatedHand,
        *,
        link: Path | None = None,
        bus_link: Path | None = None,
        bus_port: str | None = None,
        listen: tuple[str, int] | None = None,
    ) -> None:
        """Open the terminals; `run` starts serving.

        Args:
            electronics: hand to serve.
            link: symbolic link to create for the board's terminal.
            bus_link: symbolic link to create for a terminal on the servo bus; None for no terminal.
            bus_port: serial port (device path or pyserial URL) of the servo bus; start the hand `bare`, so that only
                one board drives the servos.
            listen: host and port of an additional `rfc2217://` server with DTR and RTS; 0 for any free port.

        Raises:
            FileExistsError: `link` or `bus_link` exists already.
            OSError: listening on the address failed.
            serial.SerialException: the port cannot be opened.
        """
        self.listeners: list[Callable[[WireEntry], None]] = []
        """Observers of the bytes on the board's terminal; one that raises is removed."""
        self.on_late: Callable[[float], object] = lambda _late_s: None
        """Called with the delay (s) when the board runs behind schedule; below 1 ms on an idle computer."""
        self._electronics = electronics
        self._takers: dict[End, Callable[[bytes], object]] = {}
        with ExitStack() as opened:
            self._link = link
            self._away_until: float | None = None
            self._host = Terminal(link)
            opened.callback(self._host.close)
            self._takers[self._host] = electronics.receive
            self._network = None if listen is None else NetworkPort(*listen, self._reset_by_lines)
            if self._network is not None:
                opened.callback(self._network.close)
                self._takers[self._network] = electronics.receive
            self._bus = Terminal(bus_link) if bus_link is not None else None
            if self._bus is not None:
                opened.callback(self._bus.close)
                self._takers[self._bus] = put_on_bus(electronics.bus, self._bus)
            if bus_port is not None:
                port = SerialPort(bus_port)
                self._takers[port] = put_on_bus(electronics.bus, port)
            opened.pop_all()

    @property
    def name(self) -> str:
        """Path of the board's terminal, for clients."""
        return self._host.name

    @property
    def url(self) -> str | None:
        """URL of the board's network server, or None without one."""
        return None if self._network is None else self._network.name

    def run(self, stop: Callable[[], bool]) -> None:
        """Serve in real time until `stop()`, polled at least every 50 ms, returns true."""
        kernel = self._electronics.kernel
        self._electronics.on_transmit = self._transmit
        self._electronics.on_reset = self._went_away
        if unread := self._electronics.take_output():
            self._host.write(unread)
        serve(kernel, self._takers, self._take, stop, after=self._come_back, on_late=self.on_late)

    def close(self) -> None:
        """Close the terminals and remove their links; a second call does nothing."""
        for end in self._takers:
            end.close()

    def _reset_by_lines(self, download: bool) -> None:
        self._electronics.reset("reset", download=download)

    def _went_away(self, cause: ResetCause) -> None:
        """Close the port after a loss of power; USB stays connected during every other reset."""
        if cause not in REENUMERATES:
            return
        self._electronics.on_transmit = self._electronics.keep
        self._away_until = self._electronics.kernel.now + ENUMERATION_S
        if self._network is not None:
            self._network.hang_up()
        if self._takers.pop(self._host, None) is not None:  # else already closed
            self._host.close()

    def _come_back(self) -> None:
        if self._away_until is None or self._electronics.kernel.now < self._away_until:
            return
        self._away_until = None
        self._host = Terminal(self._link)
        self._takers[self._host] = self._electronics.receive
        self._electronics.on_transmit = self._transmit
        if unread := self._electronics.take_output():
            self._host.write(unread)

    def _take(self, end: End) -> None:
        if end not in self._takers:
            return
        data = end.read()
        if end is self._host:
            self._note(">", data)
        self._takers[end](data)

    def _note(self, direction: Literal[">", "<"], data: bytes) -> None:
        entry = (self._electronics.kernel.now, direction, data)
        for listener in tuple(self.listeners):
            try:
                listener(entry)
            except Exception:  # a failing subscriber does not end the link
                self.listeners.remove(listener)
                _LOG.exception("a listener of %s failed and is dropped; the link continues", self.name)

    def _transmit(self, data: bytes) -> None:
        self._note("<", data)
        self._host.write(data)
        if self._network is not None:
            self._network.write(data)
