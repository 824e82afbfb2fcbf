"""`aero-hil calibrate`: a unit file for the hand on the bench, from recordings of it."""

from __future__ import annotations

import os
from pathlib import Path

import click
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from aero.channels import Channel
from hil.cli.exits import given
from hil.cli.options import FIRMWARE, NewFolder
from hil.recordings.output import prepared_file, prepared_folder, write_whole
from hil.system_identification.calibration import Calibration, calibrate, held_out_rms
from hil.system_identification.search import pooled_rms
from hil.system_identification.trace import load_trace
from hil.system_identification.trace_plots import trace_svg
from hil.system_identification.unit_file import unit_toml
from model.units.naming import unit_named


@click.command("calibrate")
@click.argument("recordings", nargs=-1, required=True, type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--out", required=True, type=click.Path(dir_okay=False, path_type=Path), help="Unit file to write.")
@click.option("--start", default="reference", show_default=True, help="Unit to start from, or a .toml.")
@click.option("--firmware", type=click.Choice(FIRMWARE), help="Of the hand; what the recordings say if not given.")
@click.option("--plots", type=NewFolder(), help="Folder for predicted and recorded.")
@click.option("--yardstick", is_flag=True, help="Also search and score a plain P-and-damping model, minutes more.")
@click.option("--jobs", type=click.IntRange(1, 1000), default=os.cpu_count() or 1, show_default=True, help="Processes.")
def calibrate_command(
    *,
    recordings: tuple[Path, ...],
    out: Path,
    start: str,
    firmware: str | None,
    plots: Path | None,
    yardstick: bool,
    jobs: int,
) -> None:
    """Fit a unit to RECORDINGS (.mcap of `aero-hil record`, or .npz) of one right hand and write it to a file.

    Prints the fit by channel and what it is worth on recordings it has not seen.
    """
    console = Console()
    with given():
        unit = unit_named(start)
        prepared_file(out)
        if plots is not None:
            prepared_folder(plots)
        traces = [load_trace(path) for path in recordings]
    with given():
        result = calibrate(
            traces,
            unit,
            firmware=firmware,
            jobs=jobs,
            yardstick=yardstick,
            report=lambda line: console.print(line, style="dim"),
        )
    write_whole(out, unit_toml(result.unit, f"Fitted to {len(recordings)} recordings", result.fitted))
    if plots is not None:
        for trace, prediction in zip(result.traces, result.predictions, strict=True):
            write_whole(plots / f"{trace.name}.svg", trace_svg(trace, prediction))
    _print(console, result, out)


def _print(console: Console, result: Calibration, out: Path) -> None:
    table = Table("Recording", title="Counts rms, readings on their best phase of the telemetry grid", box=SIMPLE_HEAD)
    for channel in Channel:
        table.add_column(channel.label, justify="right")
    for trace, row in zip(result.traces, result.channel_rms(), strict=True):
        table.add_row(trace.name, *(f"{value:.1f}" for value in row))
    console.print(table)
    console.print(f"all recordings: {pooled_rms(result.found.residuals):.2f} counts rms")
    if result.held_out:
        console.print(
            f"each predicted from the others, telemetry phase unknown: {held_out_rms(result.held_out):.2f} counts rms"
        )
    if result.yardstick:
        console.print(f"plain P-and-damping model, the same way: {held_out_rms(result.yardstick):.2f} counts rms")
    console.print(f"unit written to {out}; use it as `--unit {out}`")
