"""Faults at the host's end of the link: a port that disappears, a program that stalls."""

from collections.abc import Iterable

from aero.clock import Clock
from aero.transport import Transport
from hil.emulated.faults.assembly import Active, HandAssembly
from hil.emulated.faults.fault import Fault, FaultLayer, Injection, Severity
from hil.targets.passing import Passing
from hil.verdict.part import Part

STALL_SHARE = 0.02
"""Fraction of the writes before which the program stalls."""


class ProgramEnd(Passing):
    """Program's end of a link, with the faults of a disappearing port and a stalling host."""

    def __init__(self, behind: Transport, clock: Clock, assembly: HandAssembly) -> None:
        """Wrap a transport with the host faults of an assembly."""
        super().__init__(behind)
        self._clock, self._assembly, self._link = clock, assembly, assembly.link

    def write(self, data: bytes) -> None:
        """Send all of `data`, late after a stall; raise ConnectionError if the port is gone."""
        for fault, seconds, random in self._assembly.stalls:
            if random.random() < STALL_SHARE:
                self._assembly.fire(fault)
                self._clock.sleep_until(self._clock.now() + seconds)
        self._check()
        self._behind.write(data)

    def read(self, size: int, timeout: float) -> bytes:
        """Read from the wrapped transport; raise ConnectionError if the port is gone."""
        self._check()
        data = self._behind.read(size, timeout)
        self._check()
        return data

    def _check(self) -> None:
        if self._link.gone():
            raise ConnectionError(f"the link to {self.name} hung up (Input/output error), as requested by the fault")


def _stalls(assembly: HandAssembly, fault: Injection) -> Active:
    stall = fault, fault.severity, assembly.random(fault)
    return Active(lambda: assembly.stalls.append(stall), lambda: assembly.stalls.remove(stall))


def refuse_at_a_port(faults: Iterable[Injection]) -> None:
    """Refuse host faults on a hand behind its own port.

    Raises:
        ValueError: a fault acts at the program's end of the link.
    """
    for fault in faults:
        if fault.fault.layer is FaultLayer.HOST:
            raise ValueError(
                f"{fault} needs the program's end of the link, which only the target `emulated` has; for link_hangs_up "
                "on a port, use `aero-hil proxy`"
            )


# fmt: off
FAULTS = (
    Fault("host_stalls", FaultLayer.HOST, Part.COMPUTER, "scheduling stalls of the program",
          _stalls, severity=Severity("s", (0.02, 0.1, 0.5), 0, 60)),
)
# fmt: on
