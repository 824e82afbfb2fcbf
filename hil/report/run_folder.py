"""Content of a run's folder: files of `aero-hil validate`, of the case, and of the commands that read the run."""

from contextlib import suppress
from pathlib import Path

from hil.checks import EXPERIMENTS, WHOLE_RUN
from hil.recordings.errors import UnusableFileError
from hil.verdict.case_file import CASE, STEP, read_case

JUDGED_NAMES = (*EXPERIMENTS, WHOLE_RUN.name)
CASE_PAGE = "case.html"
DATA = frozenset({CASE, "checks.json", "measured.csv", *(f"{name}.mcap" for name in JUDGED_NAMES)})
"""Files that cannot be computed again from others."""
DERIVED = frozenset({CASE_PAGE, "report.html", *(f"{name}-foxglove.mcap" for name in JUDGED_NAMES)})


def recordings_in(folder: Path) -> list[Path]:
    """Return the recordings of a run's folder, without exports and other files."""
    return [path for name in JUDGED_NAMES if (path := folder / f"{name}.mcap").is_file()]


def require_no_steps(folder: Path) -> None:
    """Check that a folder can be used for a new run, because no steps of a case would be lost.

    Raises:
        UnusableFileError: the case in the folder has steps or answers, or cannot be read.
    """
    if not (folder / CASE).exists():
        return
    stored = read_case(folder)
    if stored.case.done or stored.answers:
        raise UnusableFileError(f"{folder} holds a case with {len(stored.case.done)} steps done; name another folder")


def clear_run(folder: Path) -> None:
    """Remove an earlier run from a folder; files of other names stay.

    Otherwise, recordings that the new run does not replace would be judged as a part of it.

    Raises:
        OSError: a file cannot be removed.
    """
    for name in DATA | DERIVED:
        (folder / name).unlink(missing_ok=True)
    for rerun in folder.glob(STEP.format("[0-9]*")):
        clear_run(rerun)
        with suppress(OSError):  # files of other names stay
            rerun.rmdir()
