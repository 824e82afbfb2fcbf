"""`aero-hil identify`: fit the actuation map's coefficients to the simulated hand."""

from __future__ import annotations

import json
from pathlib import Path

import click
from rich.table import Table

from aero.whole_file import write_whole
from hil.cli.exits import usage_errors
from hil.cli.options import NewFolder
from hil.cli.terminal import console as new_console
from hil.lab.map_identification.figure import draw_thumb_figure
from hil.lab.map_identification.files import coefficient_toml, report, table
from hil.lab.map_identification.identify import identify
from hil.lab.map_identification.regression import flexor_radius, two_pose_radii
from hil.recordings.output import prepared_folder
from model import RoutedHand
from model.geometry import Side


@click.command("identify")
@click.option("--hand", default="right", show_default=True, type=click.Choice(["right", "left"]))
@click.option(
    "--out",
    default="identification",
    show_default=True,
    type=NewFolder(),
    help="Folder for coefficients.toml, report.json and thumb.svg.",
)
@click.option("--figure", default="svg", show_default=True, type=click.Choice(["svg", "png", "pdf"]))
def identify_command(*, hand: Side, out: Path, figure: str) -> None:
    """Sweep the routed hand, fit the map's coefficients, and compare them with the published ones.

    The coefficient file works wherever a map is made: `aero-hil map --coefficients FILE`,
    `ActuationMap.for_firmware(..., coefficients=FILE)`.
    """
    console = new_console()
    with usage_errors():
        prepared_folder(out)
    result = identify(RoutedHand(hand), lambda step: console.print(step, style="dim"))
    radii = {"two_pose_m_per_rad": two_pose_radii(hand).tolist(), "flexor_m_per_rad": flexor_radius(hand)}
    write_whole(out / "coefficients.toml", coefficient_toml(result, hand))
    write_whole(out / "report.json", json.dumps({**report(result), "radii": radii}, indent=2))
    draw_thumb_figure(result, out / f"thumb.{figure}")
    shown = Table("", "identified", "paper", "difference")
    for row in table(result):
        shown.add_row(*row)
    console.print(shown)
    r_squared = ", ".join(f"{value:.5f}" for value in result.regression.r_squared)
    console.print(f"R² of the regression (CMC, MCP, IP): {r_squared}. Written to {out}.")
