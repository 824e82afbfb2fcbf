"""`aero-hil endurance`: many full cycles, resumable."""

from __future__ import annotations

from pathlib import Path

import click

from hil.cli.exits import usage_errors
from hil.cli.options import ChosenHand, target
from hil.cli.terminal import ProgressBar
from hil.lab.endurance import drift, read_cycles, run_endurance
from hil.recordings.output import prepared_file


@click.command()
@target
@click.option(
    "--cycles", type=click.IntRange(2, 1_000_000), required=True, help="Cycles the log shall hold in the end."
)
@click.option(
    "--log", type=click.Path(dir_okay=False, path_type=Path), default=Path("endurance.jsonl"), show_default=True,
    help="One line a cycle; an existing log is continued.",
)  # fmt: skip
def endurance(*, hand: ChosenHand, cycles: int, log: Path) -> None:
    """Open and close the whole hand many times and report what drifts.

    After any ending, Ctrl-C included, the summary is of the cycles that the log holds.
    """
    with usage_errors():
        prepared_file(log)
        read_cycles(log)
    try:
        with hand.open() as opened, ProgressBar() as bar:
            task = bar.add_task("endurance", total=1.0)
            run_endurance(
                opened, cycles, log, progress=lambda part, doing: bar.update(task, completed=part, description=doing)
            )
    finally:
        done = read_cycles(log)
        click.echo(f"{len(done)} cycles in {log}")
        for subject, row in drift(done).items() if len(done) > 1 else ():
            drifts = f"range {row['range_drift']:+.2f} % of the window, current {row['current_drift']:+.2f} A"
            click.echo(f"{subject}: {drifts}")
