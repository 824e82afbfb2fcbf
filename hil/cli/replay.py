"""`aero-hil replay`: the bytes of a recording, sent to a hand again."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np

from aero.channels import Channel
from hil.cli.exits import usage_errors
from hil.cli.options import ChosenHand, target
from hil.cli.reading import RECORDING, read
from hil.cli.viewing import telling, viewing, with_view
from hil.recordings.mcap_file import write_recording
from hil.recordings.output import prepared_file
from hil.recordings.recorder import silent
from hil.recordings.wire_replay import check_replayable, compare_replies
from hil.recordings.wire_replay import replay as run_replay
from hil.view.sources import source_of


@click.command()
@click.argument("recording", type=RECORDING)
@target
@with_view
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), help="Write the new recording here.")
def replay(
    *,
    recording: Path,
    hand: ChosenHand,
    view: bool,
    out: Path | None,
) -> None:
    """Send the bytes of RECORDING to a hand again and compare what comes back."""
    recorded = read(recording)
    with usage_errors():
        if out is not None:
            prepared_file(out)
    with viewing(view, hand) as audience, hand.open() as opened:
        with usage_errors():
            check_replayable(recorded, opened)
        audience.follow(source_of(opened))
        replayed = run_replay(recorded, opened, progress=telling(audience, silent))
    comparison = compare_replies(recorded, replayed)
    if out is not None:
        write_recording(replayed, out)
    click.echo(f"{comparison.identical} of {comparison.requests} requests answered with the same bytes")
    if not np.isnan(comparison.position_rms).all():
        rms = ", ".join(f"{channel.label} {comparison.position_rms[channel]:.0f}" for channel in Channel)
        click.echo(f"rms difference of the encoders, of 65535: {rms}")
