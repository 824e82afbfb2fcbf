"""`aero-hil replay`, `report`, `diff` and `baseline`: what one does with recordings."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Literal

import click
import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from aero.channels import Channel
from hil.cli.options import target
from hil.judging import baseline as baselines
from hil.judging.recording_diff import diff as difference
from hil.recordings.mcap_file import read_recording, write_recording
from hil.recordings.recording import Recording
from hil.recordings.wire_replay import compare_replies
from hil.recordings.wire_replay import replay as run_replay
from hil.report.page import render_report
from hil.targets.opening import open_target
from hil.targets.target import NoHandError
from hil.validation import judge_recordings

File = click.Path(exists=True, dir_okay=False, path_type=Path)
Folder = click.Path(file_okay=False, path_type=Path)


@click.command()
@click.argument("recording", type=File)
@target
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), help="Write the new recording here.")
def replay(
    *,
    recording: Path,
    target_name: str,
    firmware: str,
    hand: Literal["right", "left"],
    unit: str,
    seed: int,
    out: Path | None,
) -> None:
    """Send the bytes of RECORDING to a hand again and compare what comes back."""
    recorded = _read(recording)
    try:
        with open_target(target_name, firmware=firmware, hand=hand, unit=unit, seed=seed) as opened:
            replayed = run_replay(recorded, opened)
        comparison = compare_replies(recorded, replayed)
        if out is not None:
            out.parent.mkdir(parents=True, exist_ok=True)
            write_recording(replayed, out)
    except (NoHandError, ValueError, OSError) as error:
        raise click.UsageError(str(error)) from error
    click.echo(f"{comparison.identical} of {comparison.requests} requests answered with the same bytes")
    if not np.isnan(comparison.position_rms).all():
        rms = ", ".join(f"{channel.label} {comparison.position_rms[channel]:.0f}" for channel in Channel)
        click.echo(f"rms difference of the encoders, of 65535: {rms}")


@click.command()
@click.argument("recordings", type=File, nargs=-1, required=True)
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), default=Path("report.html"), show_default=True)
def report(*, recordings: tuple[Path, ...], out: Path) -> None:
    """Judge RECORDINGS again and write the report; exits as `validate` does."""
    try:
        judged = judge_recordings([_read(path) for path in recordings])
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_text(render_report(judged), encoding="utf-8")
    except (ValueError, OSError) as error:
        raise click.UsageError(str(error)) from error
    click.echo(f"{'within limits' if judged.passed else 'out of limits'}; {out}")
    sys.exit(0 if judged.passed else 1)


@click.command()
@click.argument("first", type=File)
@click.argument("second", type=File)
def diff(*, first: Path, second: Path) -> None:
    """Compare two recordings of one experiment, channel by channel."""
    one, other = _read(first), _read(second)
    try:
        found = difference(one, other)
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    console = Console()
    console.print(f"first:  {_describe(one)}\nsecond: {_describe(other)}", highlight=False)
    shown = Table("Channel", "rms", "mean", "worst", box=SIMPLE_HEAD, title="Encoders, second less first, % of window")
    for channel, row in found.items():
        shown.add_row(channel.label, f"{row.rms:.3f}", f"{row.mean:+.3f}", f"{row.worst:+.2f}")
    console.print(shown)
    for channel, row in found.items():
        changes = [f"{name} {a:.4g} to {b:.4g}" for name, (a, b) in row.metrics.items() if a != b]
        if changes:
            console.print(f"{channel.label}: {', '.join(changes)}", highlight=False)


@click.command()
@click.argument("results", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.argument("folder", type=Folder)
def baseline(*, results: Path, folder: Path) -> None:
    """Keep the figures of RESULTS, a folder that `validate` wrote, as the baseline FOLDER of one hand.

    Later runs of `aero-hil validate --baseline FOLDER` say what has become worse.
    """
    try:
        baselines.store(results, folder)
    except OSError as error:
        raise click.UsageError(str(error)) from error
    click.echo(f"baseline {folder}; compare with `aero-hil validate --baseline {folder}`")


def _read(path: Path) -> Recording:
    try:
        return read_recording(path)
    except ValueError as error:
        raise click.UsageError(str(error)) from error


def _describe(recording: Recording) -> str:
    header = recording.header
    hand = f"{header.hand} hand on {header.target}, firmware {header.firmware}, unit {header.unit}"
    return f"{header.experiment}, {hand}"
