"""How commands read recordings that they are given."""

from __future__ import annotations

from pathlib import Path

import click

from hil.cli.exits import given
from hil.recordings.mcap_file import read_recording
from hil.recordings.recording import Recording

RECORDING = click.Path(exists=True, dir_okay=False, path_type=Path)


def read(path: Path) -> Recording:
    """Read a recording.

    Raises:
        Ended: it is none; the message says why.
    """
    with given():
        return read_recording(path)
