"""`aero-hil report`: recordings judged again."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import click

from aero.whole_file import write_whole
from hil.cli.exits import Ended, Exit, usage_errors
from hil.cli.reading import RECORDING, judging, read
from hil.recordings.output import prepared_file
from hil.report.page import BYTES_ALONE, render_report
from hil.verdict.margins import margins_left, nearest
from hil.verdict.validation import judge_recordings


@click.command()
@click.argument("recordings", type=RECORDING, nargs=-1, required=True)
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), default=Path("report.html"), show_default=True)
def report(*, recordings: tuple[Path, ...], out: Path) -> None:
    """Judge RECORDINGS again and write the report; exits as `validate` does.

    One that was broken off is shown and not judged: the exit code is 2 then, unless something else is out of limits.
    """
    with usage_errors():
        prepared_file(out)
    made = {path: read(path) for path in recordings}
    with judging(*recordings):
        judged = judge_recordings(list(made.values()))
        # Both as they are on this disk: a relative path through a link would lead elsewhere.
        folder = out.parent.resolve()
        files = {
            r.header.experiment: Path(os.path.relpath(path.resolve(), folder)).as_posix() for path, r in made.items()
        }
        page = render_report(judged, files)
    write_whole(out, page)
    if not judged.results and not judged.end.cut:
        click.echo(BYTES_ALONE)
    if line := nearest(margins_left(made.values())):
        click.echo(line)
    cut = [str(path) for path, recording in made.items() if not recording.header.finished]
    if cut and judged.judged_passed:
        rest = "; the rest is within limits" if judged.judged else ""
        raise Ended(f"broken off, and not judged: {', '.join(cut)}{rest}; {out}", Exit.USAGE)
    click.echo(f"{'within limits' if judged.passed else 'out of limits'}; {out}")
    sys.exit(Exit.WITHIN_LIMITS if judged.passed else Exit.OUT_OF_LIMITS)
