"""`aero-hil emulate`: an emulated hand on a pseudo-terminal, in real time."""

from __future__ import annotations

import os
import signal
from contextlib import closing
from pathlib import Path

import click

from aero.actuation import ActuationMap
from aero.safety.interrupts import noted
from firmware_emulator.firmware.nvs import Nvs
from firmware_emulator.links.pty import PtyServer
from hil.cli.exits import given
from hil.cli.options import FAULT_HELP, ChosenHand, emulation
from hil.cli.viewing import viewing, with_view
from hil.faults import Schedule, parse_fault
from hil.faults.host import refuse_at_a_port
from hil.targets.emulated_hand import build_emulated
from hil.view.sources import EmulatedSource
from model.units.naming import unit_named


@click.command()
@emulation
@click.option("--link", type=click.Path(path_type=Path), help="Make PATH a symbolic link to the terminal.")
@click.option("--bus-link", type=click.Path(path_type=Path), help="Serve the raw servo bus too, linked at PATH.")
@click.option("--bus-port", help="Serve the servos on this serial port instead, to a physical board; ours stays off.")
@click.option("--state", type=click.Path(path_type=Path), help="Keep the board's stored calibration in this file.")
@click.option("--fault", "faults", multiple=True, metavar="FAULT", help=FAULT_HELP)
@with_view
@click.option("--parent", type=int, hidden=True, help="Stop when this process is gone.")
def emulate(
    *,
    hand: ChosenHand,
    link: Path | None,
    bus_link: Path | None,
    bus_port: str | None,
    state: Path | None,
    faults: tuple[str, ...],
    view: bool,
    parent: int | None,
) -> None:
    """Serve an emulated hand until it is interrupted.

    Prints one line `ready PATH` when a client may open PATH.
    """
    with noted(signal.SIGINT, signal.SIGTERM) as stopped:
        with given():
            schedule = Schedule(map(parse_fault, faults), hand.seed)
            refuse_at_a_port(schedule.faults)
            electronics, plant = build_emulated(
                unit_named(hand.unit),
                firmware=hand.firmware,
                hand=hand.side,
                seed=hand.seed,
                start="homed" if bus_port is None else "bare",
                nvs=Nvs(state),
                program=hand.program,
                schedule=schedule,
            )
            server = PtyServer(electronics, link=link, bus_link=bus_link, bus_port=bus_port)
        with server, closing(electronics), viewing(view, hand, stay=False) as audience:
            codec = ActuationMap.for_firmware(hand.firmware, hand=hand.side)
            audience.follow(EmulatedSource(electronics, plant, codec))
            click.echo(f"ready {server.name}")
            server.run(stop=lambda: bool(stopped) or (parent is not None and os.getppid() != parent))
    schedule.require_all_fired()
