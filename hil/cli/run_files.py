"""Recordings that a user names for judging: files, the folder of a run, or a bundle of `aero-hil report --bundle`."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

import click

from aero.exit_code import Exit
from hil.cli.exits import Ended, usage_errors
from hil.recordings.mcap_file import read_recording
from hil.recordings.recording import Recording
from hil.report.bundle import unpacked
from hil.report.run_folder import JUDGED_NAMES, recordings_in

RUN = click.Path(exists=True, path_type=Path)
NOT_JUDGED = {
    "excitation": "was made by `aero-hil record` and is not judged; `aero-hil calibrate` reads it",
    "policy": "was made by `aero-hil run-policy` and is not judged; `aero-hil view` and `aero-hil export` read it",
}
"""Advice by experiment name, for recordings that are not judged."""


@contextmanager
def files_of(runs: Sequence[Path]) -> Iterator[list[Path]]:
    """Yield the recordings of files, folders and bundles; those of a bundle exist during the block only.

    Raises:
        Ended: a folder or bundle has no recording of an experiment, or a bundle cannot be opened.
    """
    with ExitStack() as stack:
        found: list[Path] = []
        for run in runs:
            if run.is_file() and run.suffix != ".zip":
                found.append(run)
                continue
            with usage_errors():
                folder = run if run.is_dir() else stack.enter_context(unpacked(run, JUDGED_NAMES))
            inside = recordings_in(folder)
            if not inside:
                raise Ended(f"{run} holds no recording of an experiment; name a run of `aero-hil validate`", Exit.USAGE)
            found += inside
        yield found


def judgeable(path: Path) -> Recording:
    """Return a recording of an experiment or a session.

    Raises:
        Ended: it is of something else; the message says what reads it.
    """
    with usage_errors():
        recording = read_recording(path)
    if reason := NOT_JUDGED.get(recording.header.experiment):
        raise Ended(f"{path} {reason}", Exit.USAGE)
    if (name := recording.header.experiment) not in JUDGED_NAMES:
        raise Ended(f"{path} is of {name!r}, which this version does not know", Exit.USAGE)
    return recording
