"""`aero-hil diff`: two recordings of one experiment."""

from __future__ import annotations

from pathlib import Path

import click
from rich.box import SIMPLE_HEAD
from rich.table import Table

from hil.cli.reading import RECORDING, judging, read
from hil.cli.terminal import console as new_console
from hil.recordings.recording import Recording
from hil.verdict.recording_diff import diff as difference


@click.command()
@click.argument("first", type=RECORDING)
@click.argument("second", type=RECORDING)
def diff(*, first: Path, second: Path) -> None:
    """Compare two recordings of one experiment, channel by channel."""
    one, other = read(first), read(second)
    with judging(first, second):
        found = difference(one, other)
    console = new_console()
    console.print(f"first:  {_describe(one)}\nsecond: {_describe(other)}")
    shown = Table("Channel", "rms", "mean", "worst", box=SIMPLE_HEAD, title="Encoders, second less first, % of window")
    for channel, row in found.items():
        shown.add_row(channel.label, f"{row.rms:.3f}", f"{row.mean:+.3f}", f"{row.worst:+.2f}")
    console.print(shown)
    for channel, row in found.items():
        changes = [f"{name} {a:.4g} to {b:.4g}" for name, (a, b) in row.metrics.items() if a != b]
        if changes:
            console.print(f"{channel.label}: {', '.join(changes)}")


def _describe(recording: Recording) -> str:
    header = recording.header
    hand = f"{header.hand} hand on {header.target}, firmware {header.firmware}, unit {header.unit}"
    return f"{header.experiment}, {hand}"
