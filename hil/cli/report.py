"""`aero-hil report`: renewed verdict on recordings."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import click

from aero.exit_code import Exit
from aero.whole_file import write_whole
from hil.checks import EXPERIMENTS, WHOLE_RUN
from hil.cli.exits import Ended, judging, usage_errors
from hil.cli.options import RECORDING
from hil.cli.output import echo
from hil.cli.terminal import console as new_console
from hil.recordings.mcap_file import read_recording
from hil.recordings.output import prepared_file
from hil.recordings.recording import Recording
from hil.report.beside_run import beside_text
from hil.report.page import BYTES_ALONE, render_report
from hil.report.text import failing_lines
from hil.verdict.run_end import EndKind
from hil.verdict.validation import judge_recordings, require_one_run

NOT_JUDGED = {
    "excitation": "was made by `aero-hil record` and is not judged; `aero-hil calibrate` reads it",
    "policy": "was made by `aero-hil run-policy` and is not judged; `aero-hil view` and `aero-hil export` read it",
}
"""Advice by experiment name, for recordings that are not judged."""


@click.command()
@click.argument("recordings", type=RECORDING, nargs=-1, required=True)
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), default=Path("report.html"), show_default=True)
@click.option(
    "--beside", "others", type=RECORDING, multiple=True,
    help="Recording of another run, compared but not judged; repeatable.",
)  # fmt: skip
def report(*, recordings: tuple[Path, ...], out: Path, others: tuple[Path, ...]) -> None:
    """Judge RECORDINGS again and write the report; the exit codes are those of `validate`.

    Each recording of --beside is compared with the one of the same experiment, channel by channel.

    A truncated recording is shown without a verdict; the exit code is then 2, unless another check is out of limits.
    """
    made = {path: _judgeable(path) for path in recordings}
    _print_beside(made, others)
    # Only judging may fail for a defect of a file; an error in the page is a bug.
    with judging(*recordings):
        require_one_run({str(path): recording for path, recording in made.items()})
        judged = judge_recordings(list(made.values()))
    if not judged.results and not judged.end.cut and judged.whole_run is None:
        raise Ended("no experiment began; there is nothing to report on", Exit.USAGE)
    page = render_report(judged, _links(made, out))
    with usage_errors():
        prepared_file(out)
    write_whole(out, page)
    if not judged.results and not judged.end.cut:
        echo(BYTES_ALONE)
    if judged.withheld and not judged.findings:
        raise Ended(f"nothing is judged: {judged.withheld[0].reason}; {out}", Exit.USAGE)
    cut = [str(path) for path, recording in made.items() if not recording.header.finished]
    if cut and judged.judged_passed:
        rest = "; the rest is within limits" if judged.judged else ""
        raise Ended(f"not judged, because incomplete: {', '.join(cut)}{rest}; {out}", Exit.USAGE)
    if judged.end.kind is EndKind.HOST_BUSY:
        raise Ended(f"{judged.end.reason} {out}", Exit.HOST_BUSY)
    for line in failing_lines(judged):
        echo(line)
    echo(f"{'within limits' if judged.passed else 'out of limits'}; {out}")
    sys.exit(Exit.WITHIN_LIMITS if judged.passed else Exit.OUT_OF_LIMITS)


def _print_beside(made: Mapping[Path, Recording], others: Sequence[Path]) -> None:
    """Print each recording of another run next to the one of the same experiment.

    Raises:
        Ended: no recording of that experiment.
    """
    console = new_console()
    by_experiment = {recording.header.experiment: (path, recording) for path, recording in made.items()}
    for path in others:
        other = _judgeable(path)
        if other.header.experiment not in by_experiment:
            raise Ended(f"{path} is of {other.header.experiment}, which is not among the recordings", Exit.USAGE)
        first, recording = by_experiment[other.header.experiment]
        with judging(first, path):
            for part in beside_text(recording, other):
                console.print(part)


def _judgeable(path: Path) -> Recording:
    """Return a recording of an experiment or a session.

    Raises:
        Ended: a recording of another kind; the message names the command for it.
    """
    with usage_errors():
        recording = read_recording(path)
    if reason := NOT_JUDGED.get(recording.header.experiment):
        raise Ended(f"{path} {reason}", Exit.USAGE)
    if (name := recording.header.experiment) not in (*EXPERIMENTS, WHOLE_RUN.name):
        raise Ended(f"{path} is of {name!r}, which this version does not know", Exit.USAGE)
    return recording


def _links(made: Mapping[Path, Recording], out: Path) -> dict[str, str]:
    """Return the path of each recording relative to the page, by experiment."""
    # Both paths are resolved, because a relative path through a symbolic link would lead to another folder.
    folder = out.parent.resolve()
    return {r.header.experiment: Path(os.path.relpath(path.resolve(), folder)).as_posix() for path, r in made.items()}
