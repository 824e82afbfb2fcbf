"""Serves an emulated hand in real time: the board, and if asked the raw servo bus, on pseudo-terminals.

The kernel is the same one as on virtual time; here a loop runs it up to the wall clock whenever an event is due or
bytes arrive. Bytes are taken at the instant at which they are seen, and `log` holds those instants: the same bytes at
the same instants on virtual time give the same answers.
"""

from __future__ import annotations

import select
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType

from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import WireEntry
from firmware_emulator.links.terminal import Terminal

IDLE_S = 0.05
"""Longest wait before `stop` is looked at again, s."""


class PtyServer:
    """An emulated hand on one or two pseudo-terminals."""

    def __init__(self, emulated_hand: EmulatedHand, *, link: Path | None = None, bus_link: Path | None = None) -> None:
        """Open the terminals; nothing is served before `run`.

        Args:
            emulated_hand: what to serve.
            link: symbolic link to the board's terminal.
            bus_link: symbolic link to a terminal on the servo bus; no such terminal when None.

        Raises:
            FileExistsError: a link exists already.
        """
        self.log: list[WireEntry] | None = None
        self._hand = emulated_hand
        self._host = Terminal(link)
        self._terminals: dict[Terminal, Callable[[bytes], object]] = {self._host: emulated_hand.receive}
        self._bus: Terminal | None = None
        if bus_link is not None:
            try:
                self._bus = Terminal(bus_link)
            except OSError:
                self._host.close()
                raise
            port = emulated_hand.bus.connect(self._bus.write)
            self._terminals[self._bus] = port.write

    def __enter__(self) -> PtyServer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def name(self) -> str:
        """Path of the board's terminal, as clients open it."""
        return self._host.name

    @property
    def bus_name(self) -> str | None:
        """Path of the bus terminal, None when it is not served."""
        return None if self._bus is None else self._bus.name

    def run(self, stop: Callable[[], bool]) -> None:
        """Serve in real time until `stop()` holds; it is asked at least every 50 ms."""
        kernel = self._hand.kernel
        self._hand.on_transmit = self._transmit
        if unread := self._hand.take_output():
            self._host.write(unread)
        start = time.monotonic() - kernel.now
        while not stop():
            due = kernel.next_event()
            idle = IDLE_S if due is None else min(max(start + due - time.monotonic(), 0.0), IDLE_S)
            ready, _, _ = select.select(list(self._terminals), [], [], idle)
            kernel.run_until(time.monotonic() - start)
            for terminal in ready:
                self._take(terminal)

    def close(self) -> None:
        """Close the terminals and remove their links; a second call does nothing."""
        for terminal in self._terminals:
            terminal.close()

    def _take(self, terminal: Terminal) -> None:
        data = terminal.read()
        if terminal is self._host and self.log is not None:
            self.log.append((self._hand.kernel.now, ">", data))
        self._terminals[terminal](data)

    def _transmit(self, data: bytes) -> None:
        if self.log is not None:
            self.log.append((self._hand.kernel.now, "<", data))
        self._host.write(data)
