"""Port that `aero_port` lends to tests: an emulated hand, or a physical one behind the guard."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from aero.child_process import ChildProcess
from hil.emulated.emulated_spec import EmulatedSpec
from hil.emulated.faults.fault import Injection
from hil.emulated.lent_hand import NOT_EMULATED
from hil.emulated.pty_process import ServedPort, serve_in_child
from hil.targets.hand_spec import PortSpec

START_S, END_S = 60.0, 30.0
"""Time-outs of the guard's start and end, s; it opens the hand at its end."""


class GuardedPort:
    """Physical hand behind `aero-hil guard`; faults, acts and telemetry are refused."""

    url = ""

    def __init__(self, path: str, refuse: Callable[[str], Any]) -> None:
        self.path, self._refuse = path, refuse

    def inject(self, fault: Injection | str) -> None:
        """Refuse a fault."""
        self._refuse(NOT_EMULATED)

    clear = inject

    def act(self, words: str) -> str:
        """Refuse an act."""
        return str(self._refuse(NOT_EMULATED))

    def telemetry(self) -> Any:
        """Refuse: the true state of a physical hand is not known."""
        return self._refuse("the true state of a physical hand is not known; run with --hil=emulated")

    def renew(self, faults: Sequence[str] = ()) -> None:
        """Leave the hand to the next test; the guard has opened it."""


@contextmanager
def lent_port(spec: PortSpec, refuse: Callable[[str], Any], folder: Path) -> Iterator[ServedPort | GuardedPort]:
    """Yield the port of a hand.

    Args:
        spec: the hand; one on a port is guarded by a process of its own.
        refuse: skips a test, with the reason.
        folder: folder for the guard's recordings of stops.
    """
    if isinstance(spec, EmulatedSpec):
        with serve_in_child(spec, observed=True) as (_, port):
            yield port
        return
    options = ["--firmware", spec.firmware, "--side", spec.side, "--resume-with-next", "--black-box", str(folder)]
    child = ChildProcess([sys.executable, "-P", "-m", "hil.cli", "guard", spec.port, *options], "the guard")
    try:
        yield GuardedPort(child.wait_ready(START_S), refuse)
    finally:
        child.end(END_S)
