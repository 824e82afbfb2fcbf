"""`aero-hil emulate`: an emulated hand on a pseudo-terminal, in real time."""

from __future__ import annotations

import signal
from contextlib import closing
from pathlib import Path
from typing import Literal

import click

from firmware_emulator.firmware.nvs import Nvs
from firmware_emulator.links.pty import PtyServer
from firmware_emulator.native.program import FirmwareProgramError
from hil.cli.options import emulation, program
from hil.emulated import build_emulated
from hil.units import load_unit


@click.command()
@emulation
@program
@click.option("--link", type=click.Path(path_type=Path), help="Make PATH a symbolic link to the terminal.")
@click.option("--bus-link", type=click.Path(path_type=Path), help="Serve the raw servo bus too, linked at PATH.")
@click.option("--bus-port", help="Serve the servos on this serial port instead, to a physical board; ours stays off.")
@click.option("--state", type=click.Path(path_type=Path), help="Keep the board's stored calibration in this file.")
def emulate(
    *,
    firmware: str,
    hand: Literal["right", "left"],
    unit: str,
    seed: int,
    link: Path | None,
    bus_link: Path | None,
    bus_port: str | None,
    state: Path | None,
    firmware_program: Path | None,
) -> None:
    """Serve an emulated hand until it is interrupted.

    Prints one line `ready PATH` when a client may open PATH.
    """
    stopped: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda caught, _frame: stopped.append(caught))
    try:
        electronics, _ = build_emulated(
            load_unit(unit),
            firmware=firmware,
            hand=hand,
            seed=seed,
            start="homed" if bus_port is None else "bare",
            nvs=Nvs(state),
            program=firmware_program,
        )
        server = PtyServer(electronics, link=link, bus_link=bus_link, bus_port=bus_port)
    except (ValueError, OSError, FirmwareProgramError) as error:
        raise click.UsageError(str(error)) from error
    try:
        with server, closing(electronics):
            click.echo(f"ready {server.name}")
            server.run(stop=lambda: bool(stopped))
    except FirmwareProgramError as error:
        raise click.ClickException(str(error)) from error
