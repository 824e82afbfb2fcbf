"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from aero.actuation.window import FIRMWARE_CALIBRATIONS

Command = Callable[..., Any]

FIRMWARE = tuple(FIRMWARE_CALIBRATIONS)


def emulation(command: Command) -> Command:
    """Add the options that choose an emulated hand: firmware, side, unit and seed."""
    decorators = (
        click.option("--firmware", type=click.Choice(FIRMWARE), default="0.2.0", show_default=True, help="Version."),
        click.option("--hand", type=click.Choice(["right", "left"]), default="right", show_default=True, help="Side."),
        click.option("--unit", default="reference", show_default=True, help="Unit of the emulated hand, or a .toml."),
        click.option("--seed", type=int, default=0, show_default=True, help="Seed of the emulated hand's noise."),
    )
    for decorate in reversed(decorators):
        command = decorate(command)
    return command


def program(command: Command) -> Command:
    """Add `--firmware-program`."""
    decorate = click.option(
        "--firmware-program",
        type=click.Path(exists=True, dir_okay=False, path_type=Path),
        help="What `aero-hil firmware build` made, on the emulated board; --firmware says what it was made from.",
    )
    return decorate(command)


def target(command: Command) -> Command:
    """Add `--hil` and the options of an emulated hand."""
    decorate = click.option(
        "--hil",
        "target_name",
        default="emulated",
        show_default=True,
        metavar="TARGET",
        help="`emulated`, `pty`, or the path or pyserial URL of a hand's port.",
    )
    return decorate(emulation(command))
