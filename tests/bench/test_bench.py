"""The comparison of the bench, with times that are given instead of measured."""

import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import click
import pytest
from hypothesis import given
from hypothesis import strategies as st

ROOT = Path(__file__).parents[2]
HERE, OTHER = Path("here"), Path("other")


@pytest.fixture(scope="module")
def bench():
    """The names of bench/__main__.py, which is run from its folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "bench"))
        yield runpy.run_path(str(ROOT / "bench" / "__main__.py"), run_name="bench")
        sys.modules.pop("work", None)


@given(st.floats(1e-6, 1e3), st.floats(0.1, 10.0))
def test_a_row_is_slower_only_above_15_percent_in_both_runs(bench, seconds, factor):
    ratios, now, before = bench["compared"](
        "row", HERE, OTHER, lambda _, tree: seconds * (factor if tree is HERE else 1.0)
    )
    assert bench["is_slower"](ratios) == (now / before > 1.15)
    assert len(ratios) == (2 if now / before > 1.15 else 1)


@given(st.integers(0, 2))
def test_one_disturbed_measurement_of_six_decides_nothing(bench, disturbed):
    times = iter([9.0 if place == 2 * disturbed else 1.0 for place in range(6)])
    ratios, _, _ = bench["compared"]("row", HERE, OTHER, lambda *_: next(times))
    assert ratios == [1.0]


@pytest.mark.parametrize("second", [1.0, 1.14])
def test_one_slow_run_is_not_slower(bench, second):
    assert not bench["is_slower"]([1.5, second])


needs_git = pytest.mark.skipif(shutil.which("git") is None, reason="needs git")


@needs_git
def test_the_other_commit_is_checked_out_and_removed_again(bench):
    with bench["checked_out"]("HEAD") as tree:
        assert (tree / "hil" / "__init__.py").is_file()
        head = subprocess.run(["git", "rev-parse", "HEAD"], cwd=tree, capture_output=True, text=True, check=True).stdout
    assert not tree.exists()
    listed = subprocess.run(["git", "worktree", "list"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert str(tree) not in listed
    assert head.strip()


@needs_git
def test_an_unknown_commit_is_one_line(bench):
    with (
        pytest.raises(click.UsageError, match="cannot check out no-such-commit"),
        bench["checked_out"]("no-such-commit"),
    ):
        pass


@needs_git
def test_a_commit_on_which_no_row_runs_is_an_error():
    """It was two tracebacks and exit code 0."""
    first = subprocess.run(
        ["git", "rev-list", "--max-parents=0", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.split()[0]
    ran = subprocess.run(
        [sys.executable, "bench", "-k", "get_pos", "--against", first], cwd=ROOT, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert (ran.returncode, "Traceback" in ran.stderr) == (2, False), ran.stderr
    assert "no row runs on" in ran.stderr
