"""Interface of a bus driver under test, and the emulated bus for its tests, in a separate process."""

import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Protocol, cast

from aero.child_process import ChildProcess

START_S, ANSWER_S = 60.0, 20.0
"""Time-outs of the emulator's start and of an order, s."""
STOP_S = 10.0
"""Time-out of the emulator's exit after SIGTERM, s."""


class BusDriver(Protocol):
    """Driver interface of the suite; an adapter of a few lines implements it.

    Registers have the names of `firmware_emulator/servo/models`; values are signed register counts. Errors are raised
    as any exception. A function missing from the driver raises `NotImplementedError`.
    """

    def read(self, servo: int, register: str) -> int:
        """Return a register of one servo."""
        ...

    def write(self, servo: int, register: str, value: int) -> None:
        """Write a register of one servo and wait for the acknowledgement."""

    def sync_read(self, register: str, servos: Sequence[int]) -> Mapping[int, int | None]:
        """Return one register of several servos, by ID; None or no entry for a servo without an answer."""
        ...

    def sync_write(self, register: str, values: Mapping[int, int]) -> None:
        """Write one register of several servos, by ID."""

    def store(self, servo: int, register: str, value: int) -> None:
        """Write a register to EEPROM by the driver's sequence: torque off, unlock, write, lock."""

    def middle(self, servo: int) -> None:
        """Make the present position the middle of the turn, by the offset."""

    def close(self) -> None:
        """Close the port."""


Factory = Callable[[str, Mapping[int, str]], BusDriver]
"""Factory of a driver, from the port and the servo models by ID."""


def driver_factory(name: str) -> Factory:
    """Return the factory named `package.module:function`.

    Raises:
        ValueError: the factory cannot be imported; the message gives the reason.
    """
    module, colon, function = name.partition(":")
    if not colon:
        raise ValueError(f"--bus-driver={name}: name a factory as my_package.my_module:factory")
    try:
        return cast(Factory, getattr(import_module(module), function))
    except (ImportError, AttributeError) as error:
        raise ValueError(f"--bus-driver={name}: {error}") from error


class ServedBus:
    """Emulated robot on a pseudo-terminal, controlled by orders; each order is answered."""

    def __init__(self, port: str, process: ChildProcess) -> None:
        self.port = port
        """Path of the terminal."""
        self._process = process

    def order(self, *words: object) -> str:
        """Send an order of `feetech_robots.robot_bus.ORDERS`; return its answer.

        Raises:
            ValueError: the emulator refused the order.
            ChildError: the emulator did not answer.
        """
        self._process.send(" ".join(map(str, words)) + "\n")
        answer = self._process.read_line(ANSWER_S)
        if answer.startswith("refused"):
            raise ValueError(answer)
        return answer

    def peek(self, servo: int, register: str) -> int:
        """Return the value of a register, read inside the emulator."""
        return int(self.order("peek", servo, register))

    def pass_time(self, seconds: float) -> None:
        """Wait until the emulated time has advanced by `seconds`."""
        end = float(self.order("now")) + seconds
        while float(self.order("now")) < end:
            pass


@contextmanager
def served_bus(robot: Path) -> Iterator[ServedBus]:
    """Serve a robot file in a separate process, so that a polling driver cannot starve the emulator's interpreter.

    Raises:
        ChildError: the emulator does not start.
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
