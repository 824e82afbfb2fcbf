"""Report of the tests that a session collected and executed, written only for CI: `.ci/executed.py` adds them up."""

import json
import os
import uuid
from collections.abc import Sequence
from pathlib import Path

import pytest

FOLDER = os.environ.get("EXECUTED_TESTS")


class ExecutedTests:
    """Node identifiers of one process; each worker of pytest-xdist writes a file of its own."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._collected: set[str] = set()
        self._executed: set[str] = set()

    def pytest_itemcollected(self, item: pytest.Item) -> None:
        """Note a test, before any option deselects it."""
        self._collected.add(item.nodeid)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note a test whose call ended in anything but a skip."""
        if report.when == "call" and not report.skipped:
            self._executed.add(report.nodeid)

    def pytest_sessionfinish(self) -> None:
        """Write the report."""
        self._folder.mkdir(parents=True, exist_ok=True)
        table: dict[str, Sequence[str]] = {"collected": sorted(self._collected), "executed": sorted(self._executed)}
        (self._folder / f"{uuid.uuid4()}.json").write_text(json.dumps(table), encoding="utf-8")


def pytest_configure(config: pytest.Config) -> None:
    """Report only where CI names a folder."""
    if FOLDER:
        config.pluginmanager.register(ExecutedTests(Path(FOLDER)))
