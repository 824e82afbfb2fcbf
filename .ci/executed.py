"""Fail for each test that no environment of CI executed and that no row of `not_executed.toml` excuses.

`python .ci/executed.py FOLDER`, with a folder for each run of tox, in which the `conftest.py` beside `tox.ini` wrote
the reports, and `.ci/run` the file `cut` if its time-out ended the run.
"""

from __future__ import annotations

import subprocess
import sys
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Run:
    """Node identifiers of all processes of one run of tox."""

    name: str
    deselected: frozenset[str] = frozenset()
    selected: frozenset[str] = frozenset()
    executed: frozenset[str] = frozenset()
    cut: bool = False
    """True if its time-out ended it."""


def read_run(folder: Path) -> Run:
    """Return the run whose reports are in a folder."""
    lines = [line for path in folder.glob("*.txt") for line in path.read_text(encoding="utf-8").splitlines()]
    notes = [line.partition(" ")[::2] for line in lines]

    def nodes(kind: str) -> frozenset[str]:
        return frozenset(node for what, node in notes if what == kind)

    cut = (folder / "cut").exists()
    return Run(folder.name, nodes("deselected"), nodes("selected"), nodes("executed"), cut)


def not_executed(runs: Iterable[Run], files: Iterable[str]) -> tuple[dict[str, str], list[str]]:
    """Return tests that a cut run did not reach, with its name, and others that were not executed.

    Args:
        runs: all runs.
        files: all test files, relative to the root; a file without an executed test stands for all of its tests, for
            a file that is skipped as a whole collects nothing.
    """
    runs = list(runs)
    executed = frozenset[str]().union(*(run.executed for run in runs))
    known = frozenset[str]().union(*(run.selected | run.deselected for run in runs))
    unreached = {node: run.name for run in runs if run.cut for node in run.selected - executed}
    used = {node.partition("::")[0] for node in (*executed, *unreached)}
    unused = set(files) - used
    missed = {node for node in known - executed - set(unreached) if node.partition("::")[0] not in unused}
    return unreached, sorted(unused | missed)


def main(folder: Path) -> int:
    """Print the unexcused tests; return the exit code."""
    runs = [read_run(path) for path in sorted(folder.iterdir()) if path.is_dir()] if folder.is_dir() else []
    executed = frozenset[str]().union(*(run.executed for run in runs))
    if not executed:
        print(f"no reports in {folder}: EXECUTED_TESTS did not reach pytest")
        return 1
    patterns = ("tests/**/test_*.py", "feetech_robots/tests/**/test_*.py", "lerobot_robot_aero/tests/**/test_*.py")
    listed = subprocess.run(
        ["git", "ls-files", *(f":(glob){pattern}" for pattern in patterns)],
        cwd=ROOT, capture_output=True, text=True, check=True,
    ).stdout.split()  # fmt: skip
    excuses = tomllib.loads((ROOT / ".ci" / "not_executed.toml").read_text(encoding="utf-8"))["excuse"]
    unreached, missed = not_executed(runs, listed)
    unexcused = [test for test in missed if not any(fnmatchcase(test, row["tests"]) for row in excuses)]
    for test, name in sorted(unreached.items()):
        print(f"not judged, because {name} was cut by its time-out: {test}")
    for test in unexcused:
        print(f"no environment of CI executed {test}")
    excused = len(missed) - len(unexcused)
    print(f"{len(executed)} tests executed, {excused} excused, {len(unreached)} not judged, {len(unexcused)} missed")
    return bool(unexcused)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
