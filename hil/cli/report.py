"""`aero-hil report`: renewed verdict on recordings."""

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import click

from aero.exit_code import Exit
from aero.whole_file import write_whole
from hil.cli.doctor import examine
from hil.cli.exits import Ended, judging, usage_errors
from hil.cli.output_files import BUNDLE, PAGE
from hil.cli.run_files import RUN, files_of, judgeable
from hil.dialogue.printing import echo
from hil.recordings.recording import Recording
from hil.report.bundle import write_bundle
from hil.report.page import BYTES_ALONE, render_report
from hil.report.run_folder import JUDGED_NAMES
from hil.report.text import failing_lines
from hil.verdict.run_end import EndKind
from hil.verdict.validation import judge_recordings, require_one_run


@click.command()
@click.argument("runs", metavar="RUN...", type=RUN, nargs=-1, required=True)
@click.option("--out", type=PAGE, default=Path("report.html"), show_default=True, help="Page to write.")
@click.option(
    "--bundle", type=BUNDLE,
    help="Zip file for a bug report: RUN, a folder, without names of user, home folder and computer.",
)  # fmt: skip
def report(*, runs: tuple[Path, ...], out: Path, bundle: Path | None) -> None:
    """Judge each RUN again and write the report; the exit codes are those of `validate`.

    RUN is the folder of a run, a recording of it, or its bundle.

    A truncated recording is shown without a verdict; the exit code is then 2, unless another check is out of limits.
    """
    if bundle is not None:
        with usage_errors():
            BUNDLE.prepared(bundle)
        _pack(runs, bundle)
    with files_of(runs) as paths:
        made = {path: judgeable(path) for path in paths}
    # Only judging may fail for a defect of a file; an error in the page is a bug.
    with judging(*made):
        require_one_run({str(path): recording for path, recording in made.items()})
        judged = judge_recordings(list(made.values()))
    if not judged.results and not judged.end.cut and judged.whole_run is None:
        raise Ended("no experiment began; there is nothing to report on", Exit.USAGE)
    page = render_report(judged, _links(made, out))
    with usage_errors():
        PAGE.prepared(out)
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


def _pack(runs: Sequence[Path], bundle: Path) -> None:
    """Write the bundle of one run's folder and print its size."""
    if len(runs) != 1 or not runs[0].is_dir():
        raise Ended("--bundle packs the folder of one run; name that", Exit.USAGE)
    for line in write_bundle(runs[0], JUDGED_NAMES, bundle, [found.as_dict() for found in examine()]):
        echo(f"left out: {line}", err=True)
    echo(f"{bundle}: {bundle.stat().st_size / 1e3:.0f} kB")


def _links(made: Mapping[Path, Recording], out: Path) -> dict[str, str]:
    """Return the path of each existing recording relative to the page, by experiment."""
    # Both paths are resolved, because a relative path through a symbolic link would lead to another folder.
    folder = out.parent.resolve()
    return {
        recording.header.experiment: Path(os.path.relpath(path.resolve(), folder)).as_posix()
        for path, recording in made.items()
        if path.exists()  # recordings of a bundle were temporary
    }
