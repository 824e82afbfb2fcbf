"""Fail for each test that no environment of CI executed and that no row of `not_executed.toml` excuses.

`python .ci/executed.py FOLDER`, with the reports that the `conftest.py` beside `tox.ini` wrote there.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def not_executed(reports: Iterable[Mapping[str, Sequence[str]]], files: Iterable[str]) -> list[str]:
    """Return tests that were collected and never executed, and test files of which none was.

    Args:
        reports: `collected` and `executed` node identifiers of each session.
        files: all test files, relative to the root; a file that is skipped as a whole collects nothing.
    """
    collected: set[str] = set()
    executed: set[str] = set()
    for report in reports:
        collected |= set(report["collected"])
        executed |= set(report["executed"])
    used = {node.partition("::")[0] for node in executed}
    unused = set(files) - used
    return sorted(unused | {node for node in collected - executed if node.partition("::")[0] not in unused})


def main(folder: Path) -> int:
    """Print the unexcused tests; return the exit code."""
    reports = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(folder.glob("*.json"))]
    if not reports:
        print(f"no reports in {folder}: EXECUTED_TESTS did not reach pytest")
        return 1
    patterns = ("tests/**/test_*.py", "feetech_robots/tests/**/test_*.py", "lerobot_robot_aero/tests/**/test_*.py")
    listed = subprocess.run(
        ["git", "ls-files", *(f":(glob){pattern}" for pattern in patterns)],
        cwd=ROOT, capture_output=True, text=True, check=True,
    ).stdout.split()  # fmt: skip
    excuses = tomllib.loads((ROOT / ".ci" / "not_executed.toml").read_text(encoding="utf-8"))["excuse"]
    missed = not_executed(reports, listed)
    unexcused = [test for test in missed if not any(fnmatchcase(test, row["tests"]) for row in excuses)]
    for test in unexcused:
        print(f"no environment of CI executed {test}")
    executed = len(set().union(*(report["executed"] for report in reports)))
    print(f"{executed} tests executed, {len(missed) - len(unexcused)} excused, {len(unexcused)} missed")
    return bool(unexcused)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
