"""`aero-hil export`: a recording for other programs."""

from __future__ import annotations

from pathlib import Path

import click

from aero.whole_file import write_whole
from hil.cli.exits import usage_errors
from hil.cli.output import echo
from hil.cli.reading import RECORDING, judging, read
from hil.recordings.output import prepared_file
from hil.report.foxglove.export import LAYOUT, export, layout


@click.command("export")
@click.argument("recording", type=RECORDING)
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    help="File to write; NAME-foxglove.mcap beside the recording if not given.",
)
@click.option(
    "--layout", "layout_file", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE",
    help=f"Also write the layout of Foxglove's panels, for example to {LAYOUT}.",
)  # fmt: skip
def export_command(*, recording: Path, out: Path | None, layout_file: Path | None) -> None:
    """Write RECORDING again with what Foxglove's panels understand: joint states, the hand in 3D, findings.

    The file holds the recording too, so every other command reads it. Open it in Foxglove, then Layouts, Import from
    file, and take the layout.
    """
    path = recording.with_name(f"{recording.stem}-foxglove.mcap") if out is None else out
    with usage_errors():
        prepared_file(path)
        if layout_file is not None:
            prepared_file(layout_file)
        if path.exists() and path.samefile(recording):
            raise ValueError(f"{path} is the recording itself; give another file with --out")
    made = read(recording)
    with judging(recording):
        export(made, path)
    if layout_file is not None:
        write_whole(layout_file, layout())
    grown = path.stat().st_size / recording.stat().st_size
    echo(f"{path}: {path.stat().st_size / 1e6:.1f} MB, {grown:.2f} times the recording")
