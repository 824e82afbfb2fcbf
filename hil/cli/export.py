"""`aero-hil export`: conversion of a recording for other programs."""

from __future__ import annotations

from pathlib import Path

import click

from hil.cli.exits import judging, usage_errors
from hil.cli.options import RECORDING
from hil.cli.output import echo
from hil.recordings.mcap_file import read_recording
from hil.recordings.output import prepared_file
from hil.report.film import write_film
from hil.report.foxglove import LAYOUT, export
from model.pictures import check_drawing


@click.command("export")
@click.argument("recording", type=RECORDING)
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    help="File to write; NAME.gif writes a film. Default: NAME-foxglove.mcap beside the recording.",
)
def export_command(*, recording: Path, out: Path | None) -> None:
    """Convert RECORDING for Foxglove, with joint states, the hand in 3D and the findings.

    The file includes the recording, so every other command reads it. Open the file in Foxglove, then choose Layouts,
    Import from file, and the printed layout. A film requires a recording of `run-policy` with an emulated hand.
    """
    path = recording.with_name(f"{recording.stem}-foxglove.mcap") if out is None else out
    film = path.suffix == ".gif"
    with usage_errors():
        prepared_file(path)
        if path.exists() and path.samefile(recording):
            raise ValueError(f"{path} is the recording itself; give another file with --out")
        if film:
            check_drawing("a film")
        made = read_recording(recording)
    with judging(recording):
        (write_film if film else export)(made, path)
    if film:
        echo(path)
        return
    grown = path.stat().st_size / recording.stat().st_size
    echo(f"{path}: {path.stat().st_size / 1e6:.1f} MB, {grown:.2f} times the recording")
    if "codes" not in made.series:
        echo("no joint states: this recording holds bytes only, which `aero-hil report` shows")
    echo(f"layout of the panels: {LAYOUT}")
