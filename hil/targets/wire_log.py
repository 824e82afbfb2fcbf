"""Transport with a log of its bytes."""

import logging
from collections import deque
from collections.abc import Callable
from itertools import islice
from typing import Literal, NamedTuple

from aero.clock import Clock
from aero.transport import Transport

_LOG = logging.getLogger(__name__)
Direction = Literal["to_hand", "from_hand"]
STORED_RECORDS = 500_000
"""Limit of records in memory: over an hour at 50 readings and commands a second, about 100 MB."""


class WireRecord(NamedTuple):
    """Bytes that crossed the host link at one time."""

    t: float
    """Time since the start of the recording, s; in the log and for its listeners, on the log's clock."""
    direction: Direction
    data: bytes


class WireLog:
    """Wrapper of any transport that logs each write and each non-empty read with its time.

    Times are on the driver's clock, after the system accepts a write or the driver receives a read. A late write is
    therefore late in the log. Bytes that the driver discards unread are not logged.
    """

    def __init__(self, transport: Transport, clock: Clock) -> None:
        self._transport = transport
        self._clock = clock
        self.opened = clock.now()
        """Start of the log, s on the clock."""
        self.sent_at = self.opened
        """Time of the last write, s on the clock: later than the driver's call if a guard polled the hand first."""
        self._records: deque[WireRecord] = deque(maxlen=STORED_RECORDS)
        """Latest records, times on the clock."""
        self._logged = 0
        self.listeners: list[Callable[[WireRecord], None]] = []
        """Called with each new record, time on the clock; a listener that raises is dropped."""

    @property
    def name(self) -> str:
        """Name of the wrapped transport."""
        return self._transport.name

    def write(self, data: bytes) -> None:
        """Log and send all of `data`."""
        try:
            self._transport.write(data)
        finally:  # a failed write is logged too, as the command that the driver intended
            if data:  # a resynchronisation may write no byte
                self.sent_at = self._log("to_hand", bytes(data))

    def read(self, size: int, timeout: float) -> bytes:
        """Read from the wrapped transport and log the bytes."""
        data = self._transport.read(size, timeout)
        if data:
            self._log("from_hand", data)
        return data

    def discard_input(self) -> None:
        """Drop every byte received and not yet read."""
        self._transport.discard_input()

    def close(self) -> None:
        """Close the wrapped transport; the log stays."""
        self._transport.close()

    def mark(self) -> int:
        """Return a position in the log, for `since`."""
        return self._logged

    def since(self, mark: int, start: float) -> tuple[WireRecord, ...]:
        """Return the records after `mark`, with times relative to `start` (s on the clock).

        Only the last `STORED_RECORDS` records are available; a recording's file has all.
        """
        forgotten = max(0, self._logged - (self._records.maxlen or 0))
        # A copy, because a guard's thread may log concurrently, which would abort an iteration over the deque.
        late = islice(self._records.copy(), max(0, mark - forgotten), None)
        return tuple(WireRecord(t - start, direction, data) for t, direction, data in late)

    def _log(self, direction: Direction, data: bytes) -> float:
        """Log bytes and return the time, s on the clock."""
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
