"""In tox, a test that is skipped for an unexpected reason fails; `--part` shares long environments among runs."""

from __future__ import annotations

import os
import re
import sys
import zlib
from collections.abc import Generator

import pytest

ENVIRONMENT = os.environ.get("TOX_ENV_NAME") if sys.platform == "linux" else None
EXPECTED: dict[str, frozenset[str]] = {
    r"the extra `train`|import 'jax'": frozenset({"train"}),
    r"needs the extra `firmware`|compiler": frozenset({"firmware"}),
    r"(needs|no) git\b": frozenset({"history"}),
    r"drawing needs OpenGL|has OSMesa|PID namespaces|no IPv6|needs bash|needs Node": frozenset(),
    r"AERO_FIRMWARE_SOURCES|no source of|LEROBOT": frozenset(),
    # What a target leaves out.
    r"--hil|--bus-driver|not offered|not judged|are not judged|firmware `?pre": frozenset(),
    # A fault that no run meets has no case.
    r"nothing came its way|finds nothing that tells": frozenset(),
}
"""Pattern of a reason to the environments that have to run the test all the same."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let several runs share what takes long."""
    parser.addoption(
        "--part", metavar="K/N", help="Run the K-th of N parts of the tests; K counts on and wraps around."
    )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave the tests of the other parts out."""
    if part := config.getoption("--part"):
        which, of = map(int, part.split("/"))
        mine = [item for item in items if zlib.crc32(item.nodeid.encode()) % of == which % of]
        config.hook.pytest_deselected(items=[item for item in items if item not in mine])
        items[:] = mine


def expected(reason: str) -> bool:
    """Return whether this environment may skip a test for a reason."""
    return any(re.search(pattern, reason) and ENVIRONMENT not in has for pattern, has in EXPECTED.items())


def _judged(report: pytest.TestReport | pytest.CollectReport) -> None:
    if ENVIRONMENT and report.skipped and not hasattr(report, "wasxfail") and isinstance(report.longrepr, tuple):
        reason = report.longrepr[2]
        if not expected(reason):
            report.outcome = "failed"
            report.longrepr = f"{report.nodeid}: unexpected in the environment {ENVIRONMENT}: {reason}"


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Judge the skip of a test."""
    report = yield
    _judged(report)
    return report


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Judge the skip of a file."""
    report = yield
    _judged(report)
    return report
