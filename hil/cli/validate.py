"""`aero-hil validate`: is this hand, real or emulated, as good as it should be?"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

import click
import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table

from hil.cli.before_moving import before_moving
from hil.cli.exits import Ended, Exit, ending, given
from hil.cli.options import ChosenHand, NewFolder, target
from hil.experiments import DEFAULT, EXPERIMENTS
from hil.experiments.staircase.tracking import staircase_metrics
from hil.judging.baseline import load
from hil.judging.findings import failed
from hil.judging.judged_run import Validation
from hil.recordings.output import emptied, prepared_folder, run_folder
from hil.report.page import table
from hil.report.results import write_figures, write_results
from hil.validation import validate as run_validation

SHORT_TITLES = {"Thumb abduction": "Abd.", "Thumb CMC flexion": "CMC", "Thumb flexor": "Flexor"}
"""For a terminal of 80 columns."""


@click.command()
@target
@click.option(
    "--only",
    "names",
    multiple=True,
    type=click.Choice(list(EXPERIMENTS)),
    help="Run only this experiment; may be repeated. Without it, all but homing.",
)
@click.option(
    "--baseline",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Also say what has become worse than in this folder, which `aero-hil baseline` made.",
)
@click.option("--dry-run", is_flag=True, help="Read currents and temperatures, show what would move, and stop.")
@click.option(
    "--out", type=NewFolder(),
    help="Folder for the report, the metrics and the recordings; validation/DATE-AND-TIME if not given.",
)  # fmt: skip
def validate(
    *,
    hand: ChosenHand,
    names: tuple[str, ...],
    baseline: Path | None,
    dry_run: bool,
    out: Path | None,
) -> None:
    """Check a hand: is everything there, does it move as it should, does it agree with the simulator?

    Recordings are written as they are made; after any ending, the figures of what had ended are there. Exits with 0
    when everything is within limits and 1 when not; docs/commands.md has the other codes.
    """
    console = Console()
    columns = (TextColumn("{task.description:28}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with given():
        if baseline is not None:
            load(baseline)
        opening = hand.open()
        folder = None if dry_run else prepared_folder(out) if out is not None else run_folder(Path("validation"))
        if folder is not None and (folder / "checks.json").exists():
            console.print(f"the results in {folder} are replaced", highlight=False, markup=False)
    with emptied(folder), opening as opened, Progress(*columns, console=console, transient=True) as bar:
        if dry_run or opened.guard is not None:
            console.print(before_moving(opened, _furthest(names or DEFAULT)))
        if folder is None:
            return
        task = bar.add_task("opening", total=1.0)
        result = run_validation(
            opened,
            names or DEFAULT,
            baseline=baseline,
            folder=folder,
            progress=lambda done, doing: bar.update(task, completed=done, description=doing),
            on_result=lambda so_far: write_figures(so_far, folder),
        )
    _print(console, result, folder)
    write_results(result, folder)
    _end(result, folder)


def _end(result: Validation, folder: Path) -> NoReturn:
    """Leave with the exit code of the run."""
    if result.ended_by is None:
        sys.exit(Exit.WITHIN_LIMITS if result.passed else Exit.OUT_OF_LIMITS)
    if isinstance(result.ended_by, SystemExit):
        click.echo(f"what was recorded is in {folder}", err=True)
        raise result.ended_by
    code, line = ending(result.ended_by)
    raise Ended(f"{line}; what was recorded is in {folder}", code)


def _furthest(names: tuple[str, ...]) -> Sequence[float]:
    """Return how far each channel is sent at most, (7,) share of its window."""
    return tuple(np.max([EXPERIMENTS[name].furthest for name in names], axis=0))


def _print(console: Console, result: Validation, out: Path) -> None:
    if "staircase" in result.results:
        console.print(_staircase_table(result))
    for name, ran in result.results.items():
        bad = len(failed(ran.findings))
        verdict = f"[bold]{bad} of {len(ran.findings)} failed[/bold]" if bad else f"{len(ran.findings)} checks passed"
        console.print(f"{name:10} {EXPERIMENTS[name].title}: {verdict}", highlight=False)
    failures = failed(result.findings)
    for finding in failures:
        console.print(f"[bold]failed[/bold] {finding.sentence}. {finding.meaning} {finding.remedy}", highlight=False)
    verdict = f"{len(failures)} of {len(result.findings)} checks failed" if failures else "within limits"
    console.print(
        f"{verdict}; {result.hand_seconds:.0f} s of hand time in {result.wall_seconds:.1f} s; {out / 'report.html'}"
    )


def _staircase_table(result: Validation) -> Table:
    rows = table(staircase_metrics(result.results["staircase"].recording))
    title = "Simulator and hand on one staircase; mm, abduction in mrad, rise in ms"
    shown = Table("Channel", title=title, title_justify="left", box=SIMPLE_HEAD, padding=(0, 1))
    for cell in rows[0].cells:
        shown.add_column(cell.short, justify="right")
    for row in rows:
        shown.add_row(SHORT_TITLES.get(row.title, row.title), *(c.ours for c in row.cells))
        shown.add_row("  paper", *(cell.paper for cell in row.cells), style="dim")
    return shown
