"""The tests that no environment of CI executed, from the reports of its sessions."""

import os
import runpy
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

ROOT = Path(__file__).parents[1]
PROGRAM = runpy.run_path(str(ROOT / ".ci" / "executed.py"))
Run, not_executed, read_run = PROGRAM["Run"], PROGRAM["not_executed"], PROGRAM["read_run"]
NODES = [f"{file}::{test}" for file in ("a.py", "b.py") for test in ("one", "two")]


@st.composite
def runs(draw):
    """A run that selects and deselects tests, and executes some of the selected ones."""
    selected = draw(st.sets(st.sampled_from(NODES)))
    executed = draw(st.sets(st.sampled_from(sorted(selected)))) if selected else set()
    sets = (frozenset(NODES) - selected, frozenset(selected), frozenset(executed))
    return Run(draw(st.sampled_from(["slow", "tests"])), *sets, cut=draw(st.booleans()))


@given(st.lists(runs(), min_size=1))
def test_a_test_is_executed_or_unreached_or_missed(all_runs):
    executed = {node for run in all_runs for node in run.executed}
    left = {node for run in all_runs if run.cut for node in run.selected} - executed
    unreached, missed = not_executed(all_runs, ["a.py", "b.py"])
    assert set(unreached) == left
    assert not set(missed) & (executed | left)
    assert all(node in missed or node.partition("::")[0] in missed for node in set(NODES) - executed - left)


def test_a_file_that_is_skipped_as_a_whole_is_missed():
    assert not_executed([Run("tests", executed=frozenset(["a.py::one"]))], ["a.py", "b.py"]) == ({}, ["b.py"])


BODY = """
import pytest
def test_run(): pass
@pytest.mark.skip
def test_skipped(): pass
@pytest.mark.xfail
def test_expected_to_fail(): assert False
def test_left_out(): pass
def test_last(): {last}
"""


@pytest.mark.parametrize("own_root", ["", "robots/"])
@pytest.mark.parametrize("last", ["pass", "import os; os._exit(1)"], ids=["ends", "is cut"])
def test_a_session_reports_what_it_skipped_and_what_it_deselected(tmp_path, last, own_root):
    reports = tmp_path / "reports"
    (tmp_path / "conftest.py").write_text((ROOT / "conftest.py").read_text())
    (tmp_path / own_root).mkdir(exist_ok=True)
    (tmp_path / own_root / "pytest.ini").write_text("[pytest]\n")
    (tmp_path / own_root / "test_three.py").write_text(BODY.format(last=last))
    options = (f"--confcutdir={tmp_path}", "-q", "-p", "no:aero_hil_pytest", "-p", "no:cacheprovider", "-k", "not left")
    environment = {**os.environ, "EXECUTED_TESTS": str(reports)}
    environment.pop("PYTEST_XDIST_WORKER", None)
    command = [sys.executable, "-m", "pytest", *options, f"{own_root}test_three.py"]
    subprocess.run(command, cwd=tmp_path, env=environment, check=last == "pass", capture_output=True)
    (reports / "cut").touch()
    unreached, missed = not_executed([read_run(reports)], [])
    assert missed == [f"{own_root}test_three.py::test_left_out"]
    assert set(unreached) == {f"{own_root}test_three.py::test_skipped"} | (
        {f"{own_root}test_three.py::test_last"} if last != "pass" else set()
    )
