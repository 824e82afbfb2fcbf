"""`aero-hil score`: what a unit is worth on recordings of a hand."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray
from rich.box import SIMPLE_HEAD
from rich.table import Table

from aero.channels import Channel
from hil.cli.exits import usage_errors
from hil.cli.terminal import ProgressBar
from hil.cli.terminal import console as new_console
from model.units.naming import unit_named
from train.identification.replay_score import REST, REVERSAL, SAG, ReplayScore, score
from train.identification.trace import load_trace

ITSELF = "the hand itself, commanded alike"
WITH = {
    REVERSAL: "reversing at speed",
    SAG: "more than 4 A in total: the supply sags",
    REST: "at rest at the open hand: tension of the cables",
}
"""What is shown for each cause."""


@click.command("score")
@click.argument("recordings", nargs=-1, required=True, type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--unit", default="reference", show_default=True, help="Unit: name, plausible:SEED or .toml.")
def score_command(*, recordings: tuple[Path, ...], unit: str) -> None:
    """Replay RECORDINGS of a hand into an emulated one, and show by channel how far it reads elsewhere.

    Each recording is replayed on several phases of the board's telemetry, and all count. Beside it stands how far the
    hand differs from itself on channels that recordings command alike, and which share of the error goes with the
    tension of the resting hand, with a sagging supply, and with reversals at speed. Nothing is fitted.
    """
    console = new_console()
    with usage_errors():
        emulated = unit_named(unit)
        traces = [load_trace(path) for path in recordings]
    with ProgressBar(console=console, transient=True) as bar:
        task = bar.add_task("replays", total=None)
        result = score(traces, emulated, progress=lambda done, about: bar.update(task, completed=done, total=about))
    console.print(_table(result))
    console.print(_shares(result))


def _table(result: ReplayScore) -> Table:
    table = Table("", *(channel.label for channel in Channel), "all", title="Root mean squares", box=SIMPLE_HEAD)
    for what, quantity, digits, scale in (
        ("positions, counts", "counts", 1, 1.0),
        ("currents, mA", "currents_a", 0, 1e3),
        ("warming, degC", "warming_c", 1, 1.0),
    ):
        for name, errors in (*result.runs, ("all recordings", result.all_runs), (ITSELF, result.repeats)):
            table.add_row(f"{what}: {name}", *_cells(scale * getattr(errors, quantity), digits))
    return table


def _shares(result: ReplayScore) -> Table:
    table = Table("Of the squared error", "positions, %", "currents, %", box=SIMPLE_HEAD)
    for cause, shares in result.shares.items():
        table.add_row(WITH[cause], *(f"{100 * share:.0f}" if np.isfinite(share) else "-" for share in shares))
    return table


def _cells(values: NDArray[np.float64], digits: int) -> list[str]:
    finite = values[np.isfinite(values)]
    pooled = float(np.sqrt(np.mean(finite**2))) if finite.size else np.nan
    return [f"{value:.{digits}f}" if np.isfinite(value) else "-" for value in (*values, pooled)]
