"""`aero-hil proxy`: link faults between any program and any port."""

import signal
from contextlib import ExitStack, closing
from pathlib import Path

import click

from aero.exit_code import Exit
from aero.safety.interrupts import noted
from aero.serial_transport import SerialTransport
from hil.cli.exits import Ended, usage_errors
from hil.cli.options import FAULT_HELP, RECORD, link_recorded
from hil.cli.output_files import LINK, RECORDED
from hil.dialogue.printing import echo
from hil.emulated.faults import Schedule, parse_fault
from hil.emulated.faults.proxy import LinkProxy
from hil.targets.hand_spec import PHYSICAL, named_port


@click.command()
@click.argument("port")
@click.option("--link", type=LINK, metavar="PATH", help="Create a symbolic link to the pseudo-terminal.")
@click.option("--fault", "faults", multiple=True, metavar="FAULT", help=FAULT_HELP)
@RECORD
def proxy(*, port: str, link: Path | None, faults: tuple[str, ...], record: Path | None) -> None:
    """Serve PORT (device path, pyserial URL or name) on a pseudo-terminal, with link faults in between.

    A name in hands.toml also provides version and side for --record; otherwise these are 0.2.0 and right.

    Prints one line `ready PATH` once a client can open PATH.
    """
    with noted(signal.SIGINT, signal.SIGTERM) as stopped:
        with usage_errors():
            spec = named_port(port)
            schedule = Schedule(map(parse_fault, faults))
            if link is not None:
                LINK.distinct(link)
            if record is not None:
                RECORDED.prepared(record)
        try:
            transport = SerialTransport.open(spec.port)
        except ConnectionError as error:
            raise Ended(str(error), Exit.NO_HAND) from error
        recorded = link_recorded(record, target=spec.port, unit=PHYSICAL, firmware=spec.firmware, side=spec.side)
        with closing(transport), recorded as file, ExitStack() as opened:
            with usage_errors():
                between = opened.enter_context(closing(LinkProxy(transport, schedule, link=link)))
            if file is not None:
                between.listeners.append(file.add)
            echo(f"ready {between.name}")
            between.run(stop=lambda: bool(stopped))
    schedule.require_all_fired()
