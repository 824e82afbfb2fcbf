"""How commands read recordings that they are given."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from hil.cli.exits import Ended, Exit, usage_errors
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
    """Around what is made of recordings that were given: whatever they lack ends with one line that names them.

    A recording of ours has what its experiment measures. One that was altered, or written by another program, may lack
    anything, and then Python says what.
    """
    try:
        yield
    except (LookupError, TypeError, AttributeError, ArithmeticError, ValueError) as error:
        said = str(error) if isinstance(error, ValueError) else f"{type(error).__name__} {error}"
        raise Ended(f"{', '.join(map(str, paths))}: {said}", Exit.USAGE) from error
