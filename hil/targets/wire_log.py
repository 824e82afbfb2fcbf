"""A transport that logs what crosses it."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable
from itertools import islice
from typing import Literal, NamedTuple

from aero.clock import Clock
from aero.transport import Transport

Direction = Literal["to_hand", "from_hand"]
_LOG = logging.getLogger(__name__)
STORED_RECORDS = 500_000
"""Records that are stored in memory: more than an hour of 50 readings and commands a second, some 100 MB."""


class WireRecord(NamedTuple):
    """Bytes that crossed the host link at one time."""

    t: float
    """s since the start of the recording; on the log's clock while it is made."""
    direction: Direction
    data: bytes


class WireLog:
    """Pass everything on to a transport and log each write and each read that brought bytes, with its time.

    The same log for every kind of target: bytes are logged when the system has taken them over or the driver gets them,
    at the time of the driver's clock. A host that was late to write is thereby late in the log as well.
    Bytes that the driver discards unread are not seen.
    """

    def __init__(self, transport: Transport, clock: Clock) -> None:
        self._transport = transport
        self._clock = clock
        self.opened = clock.now()
        """Time at which the tap was put on, s on the clock."""
        self.sent_at = self.opened
        """When bytes last went to the hand, s on the clock: a command, or the request of a reading. A call of a guarded
        hand may poll the hand first, which takes time on a busy machine."""
        self._records: deque[WireRecord] = deque(maxlen=STORED_RECORDS)
        """The last ones, with times of the clock."""
        self._logged = 0
        self.listeners: list[Callable[[WireRecord], None]] = []
        """Called with every record as it comes, time on the clock; one that raises is dropped."""

    @property
    def name(self) -> str:
        """Name of the transport behind."""
        return self._transport.name

    def write(self, data: bytes) -> None:
        """Log and send all of `data`."""
        try:
            self._transport.write(data)
        finally:  # what could not be sent was meant to be
            if data:  # to come back into step may take no byte
                self.sent_at = self._log("to_hand", bytes(data))

    def read(self, size: int, timeout: float) -> bytes:
        """Read as the transport does, and log what came."""
        data = self._transport.read(size, timeout)
        if data:
            self._log("from_hand", data)
        return data

    def discard_input(self) -> None:
        """Drop every byte received and not yet read."""
        self._transport.discard_input()

    def close(self) -> None:
        """Close the transport behind; the log stays."""
        self._transport.close()

    def mark(self) -> int:
        """Return a position in the log, for `since`."""
        return self._logged

    def since(self, mark: int, start: float) -> tuple[WireRecord, ...]:
        """Return what was logged after `mark`, with times relative to `start` (s on the clock).

        Of more than `STORED_RECORDS` records the last ones; a recording's file has them all.
        """
        forgotten = max(0, self._logged - (self._records.maxlen or 0))
        # A guard's thread may log meanwhile, which ends an iteration over the deque itself.
        late = islice(self._records.copy(), max(0, mark - forgotten), None)
        return tuple(WireRecord(t - start, direction, data) for t, direction, data in late)

    def _log(self, direction: Direction, data: bytes) -> float:
        """Log bytes and return when, s on the clock."""
        record = WireRecord(self._clock.now(), direction, data)
        self._records.append(record)
        self._logged += 1
        for listener in tuple(self.listeners):
            try:
                listener(record)
            except Exception:  # a failing subscriber does not end the link
                self.listeners.remove(listener)
                _LOG.exception("a listener of %s failed and is dropped; the link continues", self.name)
        return record.t
