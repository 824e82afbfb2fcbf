"""A driver of the servo bus under test, and the emulated bus that it is tested on, in a process of its own."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Protocol, cast

from aero.child_process import ChildProcess

START_S, ANSWER_S = 60.0, 20.0
"""Time the emulator has to start, and to carry out an order, s."""
STOP_S = 10.0
"""Time the emulator has to leave after SIGTERM, s."""


class BusDriver(Protocol):
    """What the suite asks of a driver; an adapter of a few lines gives it.

    Registers have the names of `firmware_emulator/servo/models`, values are register counts with their sign. What goes
    wrong is told by any exception. What a driver has no call for raises `NotImplementedError`.
    """

    def read(self, servo: int, register: str) -> int:
        """Return a register of one servo."""
        ...

    def write(self, servo: int, register: str, value: int) -> None:
        """Write a register of one servo, and hear that it was taken."""

    def sync_read(self, register: str, servos: Sequence[int]) -> Mapping[int, int | None]:
        """Return one register of several servos; None, or no entry, for one that did not answer."""
        ...

    def sync_write(self, register: str, values: Mapping[int, int]) -> None:
        """Write one register of several servos, by ID."""

    def store(self, servo: int, register: str, value: int) -> None:
        """Write a register for good, in the order that the driver has for that: torque, lock, write, lock."""

    def middle(self, servo: int) -> None:
        """Make the present position the middle of the turn, by the offset."""

    def close(self) -> None:
        """Give the port back."""


Factory = Callable[[str, Mapping[int, str]], BusDriver]
"""Makes a driver of a port and the models by ID."""


def driver_factory(name: str) -> Factory:
    """Return the factory of `package.module:function`.

    Raises:
        ValueError: there is none; the message says why.
    """
    module, colon, function = name.partition(":")
    if not colon:
        raise ValueError(f"--bus-driver={name}: name a factory as my_package.my_module:factory")
    try:
        return cast(Factory, getattr(import_module(module), function))
    except (ImportError, AttributeError) as error:
        raise ValueError(f"--bus-driver={name}: {error}") from error


class ServedBus:
    """An emulated robot on a pseudo-terminal, and orders to it; each order is answered."""

    def __init__(self, port: str, process: ChildProcess) -> None:
        self.port = port
        """Path of the terminal."""
        self._process = process

    def order(self, *words: object) -> str:
        """Give an order of `feetech_robots.robot_bus.ORDERS`; return what it says.

        Raises:
            ValueError: it was refused.
            ChildError: there is no answer.
        """
        self._process.send(" ".join(map(str, words)) + "\n")
        answer = self._process.read_line(ANSWER_S)
        if answer.startswith("refused"):
            raise ValueError(answer)
        return answer

    def peek(self, servo: int, register: str) -> int:
        """Return what a register really holds."""
        return int(self.order("peek", servo, register))

    def pass_time(self, seconds: float) -> None:
        """Return when the emulated time has gone on by this much."""
        end = float(self.order("now")) + seconds
        while float(self.order("now")) < end:
            pass


@contextmanager
def served_bus(robot: Path) -> Iterator[ServedBus]:
    """Serve a robot's file in a process of its own, so that it shares no interpreter with a driver that polls.

    Raises:
        ChildError: it does not start.
    """
    with tempfile.TemporaryDirectory() as folder:
        link = Path(folder) / "bus"
        command = [sys.executable, "-P", "-m", "hil.cli", "emulate-bus", str(robot), "--link", str(link), "--orders"]
        process = ChildProcess(command, "`aero-hil emulate-bus`")
        process.wait_ready(START_S)
        try:
            yield ServedBus(str(link), process)
        finally:
            process.end(STOP_S)
