"""`aero-hil identify`: fit the actuation map's coefficients to the simulated hand."""

from __future__ import annotations

from pathlib import Path

import click

from aero.whole_file import write_whole
from hil.cli.exits import usage_errors
from hil.cli.options import NewFolder
from hil.cli.terminal import console as new_console
from hil.cli.terminal import print_columns
from hil.recordings.output import prepared_folder
from model import RoutedHand
from model.geometry import Side
from train.identification.map_identification import coefficient_toml, comparison, identify


@click.command("identify")
@click.option("--hand", default="right", show_default=True, type=click.Choice(["right", "left"]))
@click.option(
    "--out", default="identification", show_default=True, type=NewFolder(), help="Folder for coefficients.toml."
)
def identify_command(*, hand: Side, out: Path) -> None:
    """Sweep the routed hand, fit the map's coefficients, and compare them with the published ones.

    The coefficient file works wherever a map is made: `aero-hil map --coefficients FILE`,
    `ActuationMap.for_firmware(..., coefficients=FILE)`.
    """
    with usage_errors():
        prepared_folder(out)
    result = identify(RoutedHand(hand))
    write_whole(out / "coefficients.toml", coefficient_toml(result, hand))
    (_, *heads), *rows = comparison(result)
    console = new_console()
    print_columns(console, "", heads, {name: cells for name, *cells in rows})
    r_squared = ", ".join(f"{value:.5f}" for value in result.regression.r_squared)
    console.print(f"R² of the regression (CMC, MCP, IP): {r_squared}. Written to {out / 'coefficients.toml'}.")
