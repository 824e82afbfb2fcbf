"""`aero-hil calibrate`: fit of a unit file to recordings of a physical hand."""

import os
from dataclasses import replace
from pathlib import Path

import click
import numpy as np
from rich.console import Console

from aero.channels import Channel
from aero.firmware import FIRMWARE
from aero.safety import unwinding
from aero.whole_file import write_whole
from hil.cli.exits import usage_errors
from hil.cli.output_files import UNIT
from hil.dialogue.terminal import ProgressBar, print_columns
from hil.dialogue.terminal import console as new_console
from model.units.plausible import unit_named
from train.identification.calibration import Calibration, calibrate
from train.identification.cross_validation import FEWEST, PARTS, held_out_rms
from train.identification.search import pooled_rms
from train.identification.trace import load_trace
from train.identification.unit_file import PHYSICAL_UNITS, unit_toml
from train.identification.unit_parameters import numbers

OPEN = " *"
"""Mark of an interval that the recordings do not constrain."""


@click.command("calibrate")
@click.argument("recordings", nargs=-1, required=True, type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--out", required=True, type=UNIT, help="Unit file to write.")
@click.option(
    "--start", metavar="UNIT", default="reference", show_default=True, help="Starting unit: a name or a .toml file."
)
@click.option(
    "--firmware", type=click.Choice(list(FIRMWARE)), help="Firmware version; default: that of the recordings."
)
@click.option(
    "--workers",
    type=click.IntRange(1, 1000),
    default=os.cpu_count() or 1,
    show_default=True,
    help="Number of processes.",
)
def calibrate_command(
    *,
    recordings: tuple[Path, ...],
    out: Path,
    start: str,
    firmware: str | None,
    workers: int,
) -> None:
    """Fit a unit to RECORDINGS (.mcap of `aero-hil record`, or .npz) of one right or left hand and write it to a file.

    Prints each fitted number with its 95 % interval, the fit error by channel, and the error on left-out recordings (or
    parts, with fewer than three recordings). Numbers that the recordings do not determine keep the starting unit's
    values. Ctrl-C and SIGTERM write the best unit so far.
    """
    console = new_console()
    with usage_errors():
        unit = unit_named(start)
        UNIT.prepared(out)
        unfinished = UNIT.prepared(out.with_name(f"{out.stem}.unfinished.toml"))
        traces = [load_trace(path) for path in recordings]
    with unwinding(), ProgressBar() as bar:
        task = bar.add_task("fitting", total=None)
        result = calibrate(
            traces,
            unit,
            firmware=firmware,
            jobs=workers,
            report=lambda line: console.print(line, style="dim"),
            progress=lambda done_s, about_s: bar.update(
                task, completed=done_s, total=about_s, description=f"replayed {done_s:.0f} of about {about_s:.0f} s"
            ),
        )
    stopped = result.found.interrupted
    fitted_to = f"Fitted to {len(recordings)} recordings"
    if stopped is not None:
        # An earlier complete fit may exist at `out`; do not overwrite it.
        fitted_to = f"UNFINISHED, stopped before its end: {fitted_to}"
        out = unfinished
    found = replace(result.unit, unfinished=stopped is not None)
    write_whole(out, unit_toml(found, fitted_to, result.intervals, result.told))
    _print(console, result)
    if stopped is not None:
        console.print(f"the fit is unfinished; its intermediate result in {out} does not represent this hand")
        raise stopped
    if not result.arrived:
        console.print(f"The fit has not converged. Continue with --start {out}")
    console.print(f"unit written to {out}; use it as `--unit {out}`")


def _print(console: Console, result: Calibration) -> None:
    print_columns(console, "Fitted", ("value", "95 % interval", "unit"), _fitted(result))
    if not all(np.all(told) for told in result.told.values()):
        console.print(f"{OPEN.strip()} the recordings do not determine it; it stays near the start")
    runs = zip(result.traces, result.channel_rms(), strict=True)
    rms = {trace.name: [f"{value:.1f}" for value in row] for trace, row in runs}
    title = "Counts rms, readings on their best phase of the telemetry grid"
    print_columns(console, title, [channel.label for channel in Channel], rms)
    console.print(f"all recordings: {pooled_rms(result.found.residuals):.2f} counts rms")
    if result.held_out:
        what = "each" if len(result.traces) >= FEWEST else f"each of {PARTS} parts"
        console.print(f"{what} predicted from the others: {held_out_rms(result.held_out):.2f} counts rms")


def _fitted(result: Calibration) -> dict[str, list[str]]:
    """Return value, interval and unit of each fitted number by name; jointly fitted entries share a row."""
    found = {}
    values = numbers(result.unit)
    for name, (low, high) in result.intervals.items():
        rows: dict[tuple[float, float, float, bool], list[int]] = {}
        columns = (values[name].tolist(), low.tolist(), high.tolist(), result.told[name].tolist())
        for i, row in enumerate(zip(*columns, strict=True)):
            if row[1] < row[2]:
                rows.setdefault(row, []).append(i)
        field = name.split(".")[1]
        for (value, below, above, told), entries in rows.items():
            which = f" {', '.join(map(str, entries))}" if len(values[name]) > 1 else ""
            interval = f"{below:.3g} to {above:.3g}{'' if told else OPEN}"
            found[f"{field}{which}"] = [f"{value:.3g}", interval, PHYSICAL_UNITS[field]]
    return found
