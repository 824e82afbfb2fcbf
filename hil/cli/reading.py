"""How commands read recordings that they are given."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from aero.exit_code import Exit
from hil.cli.exits import Ended, usage_errors
from hil.recordings.errors import CannotBeMeasuredError, NotOneHandError, UnusableFileError
from hil.recordings.mcap_file import read_recording
from hil.recordings.recording import Recording

RECORDING = click.Path(exists=True, dir_okay=False, path_type=Path)


def read(path: Path) -> Recording:
    """Read a recording.

    Raises:
        Ended: it is none; the message says why.
    """
    with usage_errors():
        return read_recording(path)


@contextmanager
def judging(*paths: Path) -> Iterator[None]:
    """Around what is made of recordings that were given: what they lack ends with one line that names them.

    Any other error is a defect of this program and ends as one.
    """
    try:
        yield
    except NotOneHandError as error:
        raise Ended(str(error), Exit.USAGE) from error
    except (CannotBeMeasuredError, UnusableFileError) as error:
        raise Ended(f"{', '.join(map(str, paths))}: {error}", Exit.USAGE) from error
