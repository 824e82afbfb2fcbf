"""`aero-hil proxy`: faults of the link between any program and any port."""

from __future__ import annotations

import signal
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING

import click

from aero.clock import WallClock
from aero.exit_code import Exit
from aero.safety.interrupts import noted
from aero.serial_transport import SerialTransport
from hil.cli.exits import Ended, usage_errors
from hil.cli.options import FAULT_HELP, RECORD, recording_ended
from hil.cli.output import echo
from hil.faults import Schedule, parse_fault
from hil.faults.proxy import LinkProxy
from hil.recordings.output import prepared_file
from hil.targets.hand_spec import HandSpec

if TYPE_CHECKING:
    from hil.recordings.wire_file import WireFile


@click.command()
@click.argument("port")
@click.option("--link", type=click.Path(path_type=Path), help="Make PATH a symbolic link to the terminal.")
@click.option("--fault", "faults", multiple=True, metavar="FAULT", help=FAULT_HELP)
@RECORD
def proxy(*, port: str, link: Path | None, faults: tuple[str, ...], record: Path | None) -> None:
    """Serve PORT (device path, pyserial URL or name) on a pseudo-terminal, with faults of the link in between.

    A name of hands.toml also says version and side, for --record; without one they are 0.2.0 and right.

    Prints one line `ready PATH` when a client may open PATH.
    """
    with noted(signal.SIGINT, signal.SIGTERM) as stopped:
        with usage_errors():
            hand = HandSpec.named(port)
            schedule = Schedule(map(parse_fault, faults))
        try:
            transport = SerialTransport.open(hand.target)
        except ConnectionError as error:
            raise Ended(str(error), Exit.NO_HAND) from error
        file: WireFile | None = None
        with closing(transport), ExitStack() as files:
            with usage_errors():
                between = files.enter_context(closing(LinkProxy(transport, schedule, link=link)))
            if record is not None:
                # An extra that a proxy without a recording does not need.
                from hil.recordings.wire_file import WireFile  # noqa: PLC0415
                from hil.targets.target import PHYSICAL  # noqa: PLC0415

                with usage_errors():
                    prepared_file(record)
                file = WireFile(
                    record, WallClock(), target=hand.target, unit=PHYSICAL, firmware=hand.firmware, hand=hand.side,
                    on_failure=recording_ended,
                )  # fmt: skip
                files.enter_context(closing(file))
                between.listeners.append(file.add)
            echo(f"ready {between.name}")
            between.run(stop=lambda: bool(stopped))
    schedule.require_all_fired()
    if file is not None and file.failure is not None:
        raise file.failure
