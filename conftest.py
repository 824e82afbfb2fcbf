"""Report of the tests that a session collected and executed, written only for CI: `.ci/executed.py` adds them up."""

from __future__ import annotations

import os
import uuid
from collections.abc import Sequence
from pathlib import Path

import pytest

FOLDER = os.environ.get("EXECUTED_TESTS")


class ExecutedTests:
    """Node identifiers of one process, written as they come, for a session that is cut; each worker has its file."""

    def __init__(self, folder: Path, root: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._report = folder / f"{uuid.uuid4()}.txt"
        parts = root.relative_to(Path(__file__).parent).parts
        self._within = "".join(f"{part}/" for part in parts)
        """Folder that node identifiers are relative to, with a final slash."""

    def _note(self, what: str, nodes: Sequence[str]) -> None:
        with self._report.open("a", encoding="utf-8") as report:
            report.writelines(f"{what} {self._within}{node}\n" for node in nodes)

    def pytest_deselected(self, items: Sequence[pytest.Item]) -> None:
        """Note tests that an option leaves to other sessions."""
        self._note("deselected", [item.nodeid for item in items])

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """Note the tests that the session is to execute."""
        self._note("selected", [item.nodeid for item in session.items])

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note a test whose call ended in anything but a skip; an expected failure was executed."""
        if report.when == "call" and (not report.skipped or hasattr(report, "wasxfail")):
            self._note("executed", [report.nodeid])


def pytest_configure(config: pytest.Config) -> None:
    """Report only where CI names a folder."""
    if FOLDER:
        config.pluginmanager.register(ExecutedTests(Path(FOLDER), config.rootpath))
