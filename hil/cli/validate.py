"""`aero-hil validate`: is this hand, real or emulated, as good as it should be?"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Literal

import click
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table

from hil.cli.options import target
from hil.findings import failed
from hil.report import table
from hil.target import NoHandError, open_target
from hil.validation import Validation, write_results
from hil.validation import validate as run_validation


@click.command()
@target
@click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), default=Path("validation"), show_default=True,
    help="Folder for the report, the metrics and the recording.",
)  # fmt: skip
def validate(
    *, target_name: str, firmware: str, hand: Literal["right", "left"], unit: str, seed: int, out: Path
) -> None:
    """Drive the hand and the simulator through one staircase and compare them.

    Exits with 0 when everything is within limits, 1 when not, 2 on bad usage or when no hand answers.
    """
    console = Console()
    columns = (TextColumn("{task.description:18}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    try:
        with (
            open_target(target_name, firmware=firmware, hand=hand, unit=unit, seed=seed) as opened,
            Progress(*columns, console=console, transient=True) as bar,
        ):
            task = bar.add_task("open hand", total=1.0)
            result = run_validation(
                opened, progress=lambda done, doing: bar.update(task, completed=done, description=doing)
            )
        write_results(result, out)
    except (NoHandError, ValueError, OSError) as error:
        raise click.UsageError(str(error)) from error
    _print(console, result, out)
    sys.exit(0 if result.passed else 1)


def _print(console: Console, result: Validation, out: Path) -> None:
    rows = table(result.metrics)
    title = "Simulator and hand on one staircase; lengths in mm, abduction in mrad, rise in ms"
    shown = Table("Channel", title=title, title_justify="left", box=SIMPLE_HEAD, padding=(0, 1))
    for cell in rows[0].cells:
        shown.add_column(cell.short, justify="right")
    for row in rows:
        shown.add_row(row.title, *(cell.ours for cell in row.cells))
        shown.add_row("  paper", *(cell.paper for cell in row.cells), style="dim")
    console.print(shown)
    failures = failed(result.findings)
    for finding in failures:
        console.print(f"[bold]failed[/bold] {finding.sentence}. {finding.meaning} {finding.remedy}", highlight=False)
    verdict = f"{len(failures)} of {len(result.findings)} checks failed" if failures else "within limits"
    seconds = result.recording["hand"].times[-1]
    console.print(f"{verdict}; {seconds:.0f} s of hand time in {result.wall_seconds:.1f} s; {out / 'report.html'}")
