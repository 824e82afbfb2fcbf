"""`aero-hil endurance`: many full cycles, resumable."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import click
from rich.progress import Progress

from aero.errors import AeroError
from aero.safety import SafetyStopError
from hil.cli.options import target
from hil.experiments.endurance import drift, run_endurance
from hil.targets.opening import open_target
from hil.targets.target import NoHandError


@click.command()
@target
@click.option("--cycles", type=click.IntRange(min=2), required=True, help="Cycles the log shall hold in the end.")
@click.option(
    "--log", type=click.Path(dir_okay=False, path_type=Path), default=Path("endurance.jsonl"), show_default=True,
    help="One line a cycle; an existing log is continued.",
)  # fmt: skip
def endurance(
    *,
    target_name: str,
    firmware: str,
    hand: Literal["right", "left"],
    unit: str,
    seed: int,
    cycles: int,
    log: Path,
) -> None:
    """Open and close the whole hand many times and report what drifts."""
    try:
        with open_target(target_name, firmware=firmware, hand=hand, unit=unit, seed=seed) as opened, Progress() as bar:
            task = bar.add_task("endurance", total=1.0)
            done = run_endurance(
                opened, cycles, log, progress=lambda part, doing: bar.update(task, completed=part, description=doing)
            )
    except (NoHandError, ValueError, OSError) as error:
        raise click.UsageError(str(error)) from error
    except (AeroError, SafetyStopError) as error:
        raise click.ClickException(str(error)) from error
    for subject, row in drift(done).items():
        click.echo(f"{subject}: range {row['range_drift']:+.2f} % of the window, current {row['current_drift']:+.2f} A")
