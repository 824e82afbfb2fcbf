"""Faults of the host's end: a port that goes away, a program that is held up."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from random import Random

from aero.clock import Clock
from aero.transport import Transport
from hil.faults.fault import Fault, Kind

STALL_SHARE = 0.02
"""Share of the writes before which a program is held up."""
KINDS = (Kind("host_stalls", "host", ("E1", "E5"), "s", (0.02, 0.1, 0.5), "the program is held up now and then"),)

AT_THE_PROGRAM = ("host_stalls", "link_hangs_up")
"""Names of faults of the program's own end."""


def refuse_at_a_port(faults: Iterable[Fault]) -> None:
    """Refuse faults that a hand behind a port of its own cannot have.

    Raises:
        ValueError: one is of the program's end of the link.
    """
    for fault in faults:
        if fault.name in AT_THE_PROGRAM:
            raise ValueError(
                f"{fault} sits at the program's end of the link, where a hand on a port of its own cannot put it; use "
                "the target `emulated`, and for link_hangs_up `aero-hil proxy`"
            )


class Passing:
    """A transport that passes everything on."""

    def __init__(self, behind: Transport) -> None:
        self._behind = behind

    @property
    def name(self) -> str:
        """What a person calls this link."""
        return self._behind.name

    def write(self, data: bytes) -> None:
        """Send all of `data`."""
        self._behind.write(data)

    def read(self, size: int, timeout: float) -> bytes:
        """Read as the transport behind does."""
        return self._behind.read(size, timeout)

    def discard_input(self) -> None:
        """Drop every byte received and not yet read."""
        self._behind.discard_input()

    def close(self) -> None:
        """Close the transport behind."""
        self._behind.close()


class Unplugged(Passing):
    """A port that goes away."""

    def __init__(self, behind: Transport, gone: Callable[[], bool]) -> None:
        super().__init__(behind)
        self._gone = gone

    def write(self, data: bytes) -> None:
        """Send all of `data`, while there is a port."""
        self._check()
        super().write(data)

    def read(self, size: int, timeout: float) -> bytes:
        """Read, while there is a port."""
        self._check()
        data = super().read(size, timeout)
        self._check()
        return data

    def _check(self) -> None:
        if self._gone():
            raise ConnectionError(f"the link to {self.name} hung up (Input/output error), as the fault asked for")


class HeldUp(Passing):
    """A program that the system keeps from running now and then, before it writes."""

    def __init__(
        self,
        behind: Transport,
        clock: Clock,
        *,
        stall_s: float,
        from_s: float,
        random: Random,
        fired: Callable[[], None],
    ) -> None:
        """Be held up for `stall_s` (s) now and then, from `from_s` on (s on the clock)."""
        super().__init__(behind)
        self._clock, self._stall_s, self._from_s = clock, stall_s, from_s
        self._random, self._fired = random, fired

    def write(self, data: bytes) -> None:
        """Send all of `data`, perhaps late."""
        if self._clock.now() >= self._from_s and self._random.random() < STALL_SHARE:
            self._fired()
            self._clock.sleep_until(self._clock.now() + self._stall_s)
        super().write(data)
