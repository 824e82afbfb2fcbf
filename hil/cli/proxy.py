"""`aero-hil proxy`: faults of the link between any program and any port."""

from __future__ import annotations

import signal
from contextlib import closing
from pathlib import Path

import click

from aero.safety.interrupts import noted
from aero.serial_transport import SerialTransport
from hil.cli.exits import Ended, Exit, given
from hil.cli.options import FAULT_HELP
from hil.faults import Schedule, parse_fault
from hil.faults.proxy import LinkProxy


@click.command()
@click.argument("port")
@click.option("--link", type=click.Path(path_type=Path), help="Make PATH a symbolic link to the terminal.")
@click.option("--fault", "faults", multiple=True, metavar="FAULT", help=FAULT_HELP)
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of the faults.")
def proxy(*, port: str, link: Path | None, faults: tuple[str, ...], seed: int) -> None:
    """Serve PORT (device path or pyserial URL) on a pseudo-terminal, with faults of the link in between.

    Prints one line `ready PATH` when a client may open PATH.
    """
    with noted(signal.SIGINT, signal.SIGTERM) as stopped:
        with given():
            schedule = Schedule(map(parse_fault, faults), seed)
        try:
            transport = SerialTransport.open(port)
        except ConnectionError as error:
            raise Ended(str(error), Exit.NO_HAND) from error
        with closing(transport):
            with given():
                between = LinkProxy(transport, schedule, link=link)
            with closing(between):
                click.echo(f"ready {between.name}")
                between.run(stop=lambda: bool(stopped))
    schedule.require_all_fired()
