"""Files and folders that a command writes: never one of its inputs, never a file of another kind."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from hil.recordings.output import prepared_file, prepared_folder
from hil.targets.hands_file import files


class Output(click.Path):
    """Path that a command writes, existing or not."""

    def __init__(self, *, folder: bool = False) -> None:
        super().__init__(dir_okay=folder, file_okay=not folder, path_type=Path)

    def distinct(self, path: Path, *read: Path) -> Path:
        """Return `path` after checking that the running command neither reads nor otherwise writes it.

        Args:
            path: the output, as given or a default.
            read: inputs that the command line does not name.

        Raises:
            ValueError: another parameter of the command names the same file or folder.
        """
        for other, name in (*_others(self, path), *((one, "read by this command") for one in (*files(), *read))):
            if _same(path, other):
                raise ValueError(f"{path} is {name} and would be overwritten; choose another name for the output")
        return path


class OutputFile(Output):
    """File that a command writes."""

    def __init__(self, *endings: str) -> None:
        """Declare a kind of file; without an ending, an executable program."""
        super().__init__()
        self._endings = endings

    def prepared(self, path: Path, *read: Path) -> Path:
        """Prepare a file for writing: `distinct`, and write-tested; an existing one of the same kind stays until then.

        Raises:
            ValueError: it is an input, a file of another kind, or part of the run of `aero-hil validate` in its folder.
            OSError: it cannot be written.
        """
        self.distinct(path, *read)
        prepared_file(path)
        if path.is_file() and path.stat().st_size and not self._replaceable(path):
            expected = f"not *{' or *'.join(self._endings)}" if self._endings else "no program"
            raise ValueError(f"{path} exists and is {expected}; it is not replaced, choose another name")
        if _of_run(path):
            raise ValueError(f"{path} belongs to the run in this folder; choose another name")
        return path

    def _replaceable(self, path: Path) -> bool:
        return path.name.lower().endswith(self._endings) if self._endings else os.access(path, os.X_OK)


class OutputFolder(Output):
    """Folder that a command writes into; an empty name is an error instead of the current folder."""

    def __init__(self) -> None:
        super().__init__(folder=True)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path, or fail with the expected form."""
        if not str(value):
            self.fail("the name is empty; give a folder", param, ctx)
        return super().convert(value, param, ctx)

    def prepared(self, path: Path, *read: Path) -> Path:
        """Prepare a folder for writing: `distinct`, created and write-tested.

        Raises:
            ValueError: it is an input.
            OSError: it cannot be created or written.
        """
        return prepared_folder(self.distinct(path, *read))


BUNDLE = OutputFile(".zip")
EXPORT = OutputFile(".mcap", ".webp", ".gif")
FOLDER = OutputFolder()
LINK = Output()
PAGE = OutputFile(".html")
POLICY = OutputFile(".npz")
PROGRAM = OutputFile()
RECORDED = OutputFile(".mcap")
SESSIONS = OutputFile(".jsonl.xz")
STATE = Output()
UNIT = OutputFile(".toml")


def _others(output: Output, path: Path) -> Iterator[tuple[Path, str]]:
    """Yield each path on the running command line with a description; the output itself once less than it is named."""
    context = click.get_current_context(silent=True)
    if context is None:
        return
    own = True
    for parameter in context.command.params:
        value = context.params.get(parameter.name or "")
        for one in value if isinstance(value, tuple | list) else (value,):
            if own and parameter.type is output and one == path:
                own = False
            # Text too, because a unit or a policy is named or given as a file.
            elif isinstance(one, str | Path) and str(one):
                yield Path(one), f"also {parameter.get_error_hint(context)}"


def _same(one: Path, other: Path) -> bool:
    """Return whether two paths lead to one file, existing or not, through links and mounts."""
    try:
        return one.samefile(other)
    except OSError:
        return os.path.realpath(one) == os.path.realpath(other)


def _of_run(path: Path) -> bool:
    """Return whether a path is that of a recording or a result in the folder of a run."""
    if not any((path.parent / name).exists() for name in ("checks.json", "session.mcap")):
        return False
    from hil.report.run_folder import DATA  # noqa: PLC0415 - loads a physics engine

    return path.name in DATA
