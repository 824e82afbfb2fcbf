"""`aero-hil validate`: is this hand, real or emulated, as good as it should be?"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import click
import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table

from aero.safety import SafetyStopError
from firmware_emulator.native.program import FirmwareProgramError
from hil.cli.before_moving import before_moving
from hil.cli.options import program, target
from hil.experiments import DEFAULT, EXPERIMENTS
from hil.findings import failed
from hil.metrics import staircase_metrics
from hil.report import table
from hil.target import NoHandError, open_target
from hil.validation import Validation, write_results
from hil.validation import validate as run_validation

SHORT_TITLES = {"Thumb abduction": "Abd.", "Thumb CMC flexion": "CMC", "Thumb flexor": "Flexor"}
"""For a terminal of 80 columns."""


@click.command()
@target
@program
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
    "--out", type=click.Path(file_okay=False, path_type=Path), default=Path("validation"), show_default=True,
    help="Folder for the report, the metrics and the recordings.",
)  # fmt: skip
def validate(
    *,
    target_name: str,
    firmware: str,
    hand: Literal["right", "left"],
    unit: str,
    seed: int,
    names: tuple[str, ...],
    baseline: Path | None,
    dry_run: bool,
    out: Path,
    firmware_program: Path | None,
) -> None:
    """Check a hand: is everything there, does it move as it should, does it agree with the simulator?

    Exits with 0 when everything is within limits, 1 when not, 2 on bad usage or when no hand answers.
    """
    console = Console()
    columns = (TextColumn("{task.description:28}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    try:
        with (
            open_target(
                target_name, firmware=firmware, hand=hand, unit=unit, seed=seed, firmware_program=firmware_program
            ) as opened,
            Progress(*columns, console=console, transient=True) as bar,
        ):
            if dry_run or opened.guard is not None:
                console.print(before_moving(opened, _furthest(names or DEFAULT)))
            if dry_run:
                return
            task = bar.add_task("opening", total=1.0)
            result = run_validation(
                opened,
                names or DEFAULT,
                baseline=baseline,
                progress=lambda done, doing: bar.update(task, completed=done, description=doing),
            )
        write_results(result, out)
    except (NoHandError, ValueError, OSError) as error:
        raise click.UsageError(str(error)) from error
    except (SafetyStopError, FirmwareProgramError) as error:
        raise click.ClickException(str(error)) from error
    _print(console, result, out)
    sys.exit(0 if result.passed else 1)


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
