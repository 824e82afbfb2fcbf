"""A test that an environment of tox skips for an unexpected reason fails: no test goes missing unseen."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Generator

import pytest

ENVIRONMENT = os.environ.get("TOX_ENV_NAME") if sys.platform == "linux" else None
EXPECTED: dict[str, frozenset[str]] = {
    r"the extra `train`|import 'jax'": frozenset({"train"}),
    r"needs the extra `firmware`|compiler": frozenset({"firmware"}),
    r"(needs|no) git\b": frozenset({"history"}),
    r"drawing needs OpenGL|PID namespaces|no IPv6|needs bash": frozenset(),
    r"AERO_FIRMWARE_SOURCES|no source of|LEROBOT": frozenset(),
    # What a target leaves out.
    r"--hil|--bus-driver|not offered|not judged|are not judged|firmware `?pre": frozenset(),
    # A fault that no run meets has no case.
    r"nothing came its way|finds nothing that tells": frozenset(),
}
"""Pattern of a reason to the environments that have to run the test all the same."""


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
