"""The played cases of docs/diagnosis.md: each is stored as it ends, and a run that was interrupted goes on."""

from concurrent.futures import ThreadPoolExecutor

import pytest
from figures import diagnosis
from owner import Played

MOST = 3
LOST = f"plausible:{diagnosis.ALL[1].first_seed + 1}"
"""Hand at which the first run ends."""


def found_nothing(faults, unit, seed, firmware, side):
    return Played(found=not faults, case=None, cpu_s=1.0)


def ends_early(faults, unit, seed, firmware, side):
    if unit == LOST:
        raise KeyboardInterrupt
    return found_nothing(faults, unit, seed, firmware, side)


@pytest.fixture
def build(tmp_path, monkeypatch):
    monkeypatch.setattr(diagnosis, "ROOT", tmp_path)
    monkeypatch.setattr(diagnosis, "source_commit", lambda: "1234567")
    # A fresh process would not have the replaced `play`.
    monkeypatch.setattr(diagnosis, "worker_processes", lambda _count: ThreadPoolExecutor(1))
    return tmp_path / "build"


def test_a_run_that_was_interrupted_goes_on(build, monkeypatch):
    monkeypatch.setattr(diagnosis, "play", ends_early)
    with pytest.raises(KeyboardInterrupt):
        diagnosis.cases(most=MOST)
    kept = len(diagnosis.Ends("1234567").known)
    assert MOST <= kept < MOST * len(diagnosis.ALL)
    monkeypatch.setattr(diagnosis, "play", found_nothing)
    header, *rows = diagnosis.cases(most=MOST)
    assert header == diagnosis.HEADER
    assert [row[:2] for row in rows] == [
        [one.name, f"{0 if any(one.faults) else MOST} of {MOST}"] for one in diagnosis.ALL
    ]
    monkeypatch.setattr(diagnosis, "play", None)
    assert diagnosis.cases(most=MOST) == [header, *rows]


def test_an_edited_tree_begins_anew(build, monkeypatch):
    end = diagnosis.CaseEnd("", False, False, False, "", False, (), 0.0, "", 1.0)
    for commit, left in (("1234567", 1), ("1234567+changes", 0), ("", 0)):
        diagnosis.Ends(commit).add(0, 0, end)
        assert len(diagnosis.Ends(commit).known) == left


def test_a_row_counts_what_was_found():
    right = diagnosis.CaseEnd("a", True, True, True, "servo", False, ("home", "exchange"), 10.0, "", 1.0)
    wrong = diagnosis.CaseEnd("b", True, False, False, "digit", False, ("bend",), 2.0, "", 1.0)
    gone = diagnosis.CaseEnd("c", True, False, True, "", True, ("again",), 1.0, "", 1.0)
    missed = diagnosis.CaseEnd("d", False, False, True, "", False, (), 0.0, "", 1.0)
    assert diagnosis.row_of("set", [right, wrong, gone, missed]) == [
        "set", "3 of 4", "1 of 3", "1 of 3", "1 of 3", "1 of 3", "1 of 3", "1, at most 2", "2"
    ]  # fmt: skip
