"""How commands read recordings that they are given."""

from __future__ import annotations

from pathlib import Path

import click

from hil.recordings.mcap_file import read_recording
from hil.recordings.recording import Recording

RECORDING = click.Path(exists=True, dir_okay=False, path_type=Path)


def read(path: Path) -> Recording:
    """Read a recording.

    Raises:
        click.UsageError: it is none; the message says why.
    """
    try:
        return read_recording(path)
    except ValueError as error:
        raise click.UsageError(str(error)) from error
