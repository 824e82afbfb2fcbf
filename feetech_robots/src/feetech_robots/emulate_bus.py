"""Command `aero-hil emulate-bus`: any robot of bus servos on a pseudo-terminal, in real time."""

import os
import signal
import sys
from pathlib import Path

import click

from aero.safety.interrupts import noted
from feetech_robots.bus_pty import BusServer
from feetech_robots.robot_bus import RobotBus, obey
from hil.cli.exits import usage_errors
from hil.cli.options import SEED
from hil.dialogue.printing import echo as print_line


@click.command()
@click.argument("robot", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--link", type=click.Path(path_type=Path), help="Create a symbolic link PATH to the pseudo-terminal.")
@click.option("--port", help="Serve the servos on this serial port instead, to a physical master.")
@click.option("--echo", is_flag=True, help="Echo received bytes, like some adapters.")
@click.option("--seed", type=SEED, default=0, show_default=True, help="Seed of the current noise.")
@click.option(
    "--orders",
    is_flag=True,
    help="Take orders from standard input and answer each: hold, silence, heat, peek ...",
)
def emulate_bus(robot: Path, *, link: Path | None, port: str | None, echo: bool, seed: int, orders: bool) -> None:
    """Serve the servos of ROBOT, a TOML file, until interrupted.

    Prints one line `ready PATH` when a client may open PATH.
    """
    if port is not None and (link is not None or echo):
        raise click.UsageError("--port takes neither --link nor --echo: both belong to the terminal that it replaces")
    with noted(signal.SIGINT, signal.SIGTERM) as stopped:
        with usage_errors():
            built = RobotBus.of_file(robot, seed=seed)
            server = BusServer(built.chain, link=link, port=port, echo=echo)
        with server:
            if orders and sys.stdin is not None:
                server.also(StandardInput(), Orders(built).take)
            for line in built.plant.moved:
                print_line(line, err=True)
            print_line(f"ready {server.name}")
            server.run(stop=lambda: bool(stopped))


class StandardInput:
    """Standard input as an end of `BusServer`; at EOF the server continues."""

    def fileno(self) -> int:
        """Return the descriptor to wait on."""
        return sys.stdin.fileno()

    def read(self) -> bytes:
        """Return the available bytes.

        Raises:
            EOFError: standard input is at its end.
        """
        if data := os.read(self.fileno(), 4096):
            return data
        raise EOFError

    def close(self) -> None:
        """Do nothing; standard input belongs to the process."""


class Orders:
    """Executor of orders in lines of text; each order is answered with one line."""

    def __init__(self, robot: RobotBus) -> None:
        self._robot = robot
        self._begun = b""

    def take(self, data: bytes) -> None:
        """Execute the complete lines in `data`, and buffer a partial one."""
        *lines, self._begun = (self._begun + data).split(b"\n")
        for line in filter(None, lines):
            try:
                print_line(obey(self._robot, line.decode(errors="replace")))
            except ValueError as error:
                print_line(f"refused: {error}")
