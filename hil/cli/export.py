"""`aero-hil export`: conversion of a recording for other programs."""

from importlib.util import find_spec
from pathlib import Path

import click

from aero.exit_code import Exit
from aero.whole_file import write_whole
from hil.cli.exits import Ended, judging, usage_errors
from hil.cli.output_files import EXPORT
from hil.cli.run_files import RUN, judgeable
from hil.dialogue.printing import echo
from hil.recordings.mcap_file import read_recording
from hil.recordings.output import json_text
from hil.report.openhtf import openhtf_record
from hil.report.run_folder import recordings_in
from hil.verdict.validation import judge_recordings


@click.command("export")
@click.argument("source", metavar="RECORDING|RUN", type=RUN)
@click.option(
    "--out",
    type=EXPORT,
    help="File to write; NAME.gif writes a film. Default: NAME-foxglove.mcap beside RECORDING, or RUN/openhtf.json.",
)
def export_command(*, source: Path, out: Path | None) -> None:
    """Convert RECORDING for Foxglove, with joint states, the hand in 3D and the findings.

    The file includes the recording, so every other command reads it. Open the file in Foxglove, then choose Layouts,
    Import from file, and the printed layout. A film requires a recording of `run-policy` with an emulated hand.

    For the folder of a RUN, write an OpenHTF test record (JSON) for test-data platforms.
    """
    if source.is_dir():
        _openhtf(source, source / "openhtf.json" if out is None else out)
    else:
        _foxglove(source, out)


def _openhtf(folder: Path, path: Path) -> None:
    recordings = [judgeable(found) for found in recordings_in(folder)]
    if not recordings:
        raise Ended(f"{folder} holds no recording of an experiment; name a run of `aero-hil validate`", Exit.USAGE)
    with usage_errors():
        EXPORT.prepared(path)
    with judging(folder):
        judged = judge_recordings(recordings)
    if judged.header is None:
        raise Ended(f"{folder}: no experiment began; there is nothing to export", Exit.USAGE)
    record = openhtf_record(judged)
    write_whole(path, json_text(record))
    echo(f"{path}: {record['outcome']}, {sum(len(phase['measurements']) for phase in record['phases'])} measurements")


def _foxglove(recording: Path, out: Path | None) -> None:
    if find_spec("foxglove_schemas_protobuf") is None:
        raise Ended("this export needs the extra `foxglove`; from a checkout: pip install -e '.[foxglove]'", Exit.USAGE)
    from hil.report.film import write_film  # noqa: PLC0415 - a test record needs neither
    from hil.report.foxglove import LAYOUT, export  # noqa: PLC0415
    from simulator.pictures import check_drawing  # noqa: PLC0415

    path = recording.with_name(f"{recording.stem}-foxglove.mcap") if out is None else out
    film = path.suffix == ".gif"
    with usage_errors():
        EXPORT.prepared(path)
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
