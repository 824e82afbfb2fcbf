"""The tests that no environment of CI executed, from the reports of its sessions."""

import json
import os
import runpy
import subprocess
import sys
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

ROOT = Path(__file__).parents[1]
not_executed = runpy.run_path(str(ROOT / ".ci" / "executed.py"))["not_executed"]
NODES = [f"{file}::{test}" for file in ("a.py", "b.py") for test in ("one", "two")]
REPORTS = st.lists(
    st.sets(st.sampled_from(NODES)).flatmap(
        lambda collected: st.fixed_dictionaries(
            {"collected": st.just(sorted(collected)), "executed": st.lists(st.sampled_from(sorted(collected)))}
            if collected
            else {"collected": st.just([]), "executed": st.just([])}
        )
    )
)


@given(REPORTS)
def test_a_test_is_missed_unless_some_session_executed_it(reports):
    executed = {node for report in reports for node in report["executed"]}
    collected = {node for report in reports for node in report["collected"]}
    missed = set(not_executed(reports, ["a.py", "b.py"]))
    assert not missed & executed
    assert all(node in missed or node.partition("::")[0] in missed for node in collected - executed)


def test_a_file_that_is_skipped_as_a_whole_is_missed():
    assert not_executed([{"collected": ["a.py::one"], "executed": ["a.py::one"]}], ["a.py", "b.py"]) == ["b.py"]


def test_a_session_reports_what_it_skipped_and_what_it_deselected(tmp_path):
    (tmp_path / "conftest.py").write_text((ROOT / "conftest.py").read_text())
    body = "import pytest\n\ndef test_run(): pass\n\n@pytest.mark.skip\ndef test_skipped(): pass\n"
    (tmp_path / "test_three.py").write_text(body + "\ndef test_left_out(): pass\n")
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:aero_hil_pytest",
        "-p",
        "no:cacheprovider",
        "-k",
        "not left",
    ]
    environment = {**os.environ, "EXECUTED_TESTS": str(tmp_path / "reports")}
    environment.pop("PYTEST_XDIST_WORKER", None)
    subprocess.run([*command, "test_three.py"], cwd=tmp_path, env=environment, check=True, capture_output=True)
    (report,) = (json.loads(path.read_text()) for path in (tmp_path / "reports").glob("*.json"))
    assert not_executed([report], []) == ["test_three.py::test_left_out", "test_three.py::test_skipped"]
