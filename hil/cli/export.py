"""`aero-hil export`: conversion of a recording for other programs."""

from importlib.util import find_spec
from pathlib import Path

import click

from aero.exit_code import Exit
from hil.cli.exits import Ended, judging, usage_errors
from hil.cli.options import RECORDING
from hil.cli.output_files import EXPORT
from hil.dialogue.printing import echo
from hil.recordings.mcap_file import read_recording

FILMS = (".webp", ".gif")
"""Endings of a film."""


@click.command("export")
@click.argument("recording", type=RECORDING)
@click.option(
    "--out",
    type=EXPORT,
    help="File to write; NAME.webp or NAME.gif is a film. Default: NAME-foxglove.mcap beside RECORDING.",
)
def export_command(*, recording: Path, out: Path | None) -> None:
    """Convert RECORDING for Foxglove, with joint states, the hand in 3D and the findings.

    The file includes the recording, so every other command reads it. Open the file in Foxglove, then choose Layouts,
    Import from file, and the printed layout. A film requires a recording of `run-policy` with an emulated hand.
    """
    if out is not None and out.suffix in FILMS:
        _film(recording, out)
    else:
        _foxglove(recording, recording.with_name(f"{recording.stem}-foxglove.mcap") if out is None else out)


def _film(recording: Path, path: Path) -> None:
    from hil.report.film import write_film  # noqa: PLC0415 - the other export needs no drawing
    from simulator.pictures import check_drawing  # noqa: PLC0415

    with usage_errors():
        EXPORT.prepared(path)
        check_drawing("a film")
        made = read_recording(recording)
    with judging(recording):
        write_film(made, path)
    echo(f"{path}: {path.stat().st_size / 1e6:.1f} MB")


def _foxglove(recording: Path, path: Path) -> None:
    if find_spec("foxglove_schemas_protobuf") is None:
        raise Ended("this export needs the extra `foxglove`; from a checkout: pip install -e '.[foxglove]'", Exit.USAGE)
    from hil.report.foxglove import LAYOUT, export  # noqa: PLC0415 - needs the extra

    with usage_errors():
        EXPORT.prepared(path)
        made = read_recording(recording)
    with judging(recording):
        export(made, path)
    grown = path.stat().st_size / recording.stat().st_size
    echo(f"{path}: {path.stat().st_size / 1e6:.1f} MB, {grown:.2f} times the recording")
    if "codes" not in made.series:
        echo("no joint states: this recording holds bytes only, which `aero-hil report` shows")
    echo(f"layout of the panels: {LAYOUT}")
