"""`aero-hil history`: readings of one hand over its runs."""

from __future__ import annotations

from pathlib import Path

import click

from aero.exit_code import Exit
from aero.printable import printable
from aero.whole_file import write_whole
from hil.cli.exits import Ended, usage_errors
from hil.cli.output_files import PAGE
from hil.dialogue.printing import echo
from hil.dialogue.terminal import console as new_console
from hil.dialogue.terminal import print_columns
from hil.history.drift import drifts_of, tracks_of
from hil.history.runs import names_in, of_hand, runs_in
from hil.history.timeline import Trends, no_drift, render_history, trends_of


@click.command()
@click.argument("hand")
@click.argument("folders", type=click.Path(exists=True, file_okay=False, path_type=Path), nargs=-1)
@click.option(
    "--out", type=PAGE, default=Path("history.html"), show_default=True,
    help="Page to write.",
)  # fmt: skip
def history(*, hand: str, folders: tuple[Path, ...], out: Path) -> None:
    """Show the readings of HAND over all runs in FOLDERS (default: `validation`), and their drifts towards a limit.

    HAND is a name in hands.toml or a serial number. A drift is reported after five runs without a repair in between.
    """
    places = folders or (Path("validation"),)
    if not folders and not places[0].is_dir():
        raise Ended("there is no folder `validation` here; name the folders with the runs", Exit.USAGE)
    runs, refused = runs_in(places)
    for folder, reason in refused:
        echo(f"left out: {folder}: {reason}", err=True)
    with usage_errors():
        mine, doubtful = of_hand(runs, hand)
    for folder, reason in doubtful:
        echo(f"left out: {folder}: {reason}", err=True)
    if not mine:
        known = f"hands there: {named}" if (named := ", ".join(names_in(runs))) else "no run there names its hand"
        raise Ended(f"no run of {printable(hand)!r}; {known}", Exit.USAGE)
    tracks = tracks_of(mine)
    drifts = drifts_of(tracks)
    with usage_errors():
        PAGE.prepared(out)
    write_whole(out, render_history(hand, mine, tracks, drifts))
    _print_trends(trends_of(tracks, mine))
    for drift in drifts:
        echo(drift.sentence)
    if not drifts:
        echo(no_drift(tracks))
    days, count = (mine[-1].started - mine[0].started).days, f"{len(mine)} run{'s' if len(mine) != 1 else ''}"
    echo(f"{count} in {days} days, {len(drifts)} drifting towards a limit; {out}")


def _print_trends(trends: Trends) -> None:
    """Print the last reading of each channel's trends."""
    rows = {row.subject: [cell.last if cell else "" for cell in row.cells] for row in trends.rows}
    if rows:
        print_columns(new_console(), "last readings", trends.titles, rows)
