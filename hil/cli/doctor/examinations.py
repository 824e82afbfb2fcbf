"""The table of examinations, in the order in which they are shown."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from aero.clock import WallClock
from hil.cli.doctor.finding import Examined
from hil.cli.doctor.hand import check_hand
from hil.cli.doctor.installation import check_installation
from hil.cli.doctor.machine import check_drawing, check_jitter, lateness_s
from hil.cli.doctor.ports import check_ports, holders, list_ports, read_port


def _ports(named: str) -> Iterator[Examined]:
    ports = list_ports()
    if named and all(port.device != named for port in ports) and Path(named).exists():
        ports += (read_port(named),)
    return check_ports(ports, named)


EXAMINATIONS: tuple[Callable[[], Iterable[Examined]], ...] = (
    check_installation,
    lambda: [check_drawing()],
    lambda: [check_jitter(lateness_s(WallClock()))],
)
"""Examinations of this machine."""
EXAMINATIONS_OF_A_PORT: tuple[Callable[[str], Iterable[Examined]], ...] = (
    _ports,
    lambda named: check_hand(named, holders(named)) if named else (),
)
"""Each takes the port that was named, empty without one."""


def examine(named: str = "") -> Iterator[Examined]:
    """Yield every finding as it is made."""
    for examination in EXAMINATIONS:
        yield from examination()
    for examination_of_a_port in EXAMINATIONS_OF_A_PORT:
        yield from examination_of_a_port(named)
