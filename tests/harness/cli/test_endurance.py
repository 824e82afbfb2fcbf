"""Endurance counts, resumes, and tells drift from none."""

import pytest
from click.testing import CliRunner
from full_disk import available, full_disk
from hypothesis import given
from hypothesis import strategies as st

from hil import open_target
from hil.cli import main
from hil.cli.endurance import Cycle, drift, read_cycles, run_endurance


def run(log, cycles):
    arguments = ["endurance", "--cycles", str(cycles), "--log", str(log)]
    return CliRunner().invoke(main, arguments, catch_exceptions=False)


def test_an_interrupted_run_goes_on_where_it_stopped(tmp_path):
    log = tmp_path / "cycles.jsonl"
    assert run(log, 3).exit_code == 0
    first = log.read_text()
    result = run(log, 5)
    assert log.read_text().startswith(first)
    cycles = read_cycles(log)
    assert len(cycles) == 5
    assert all(cycle.closed_percent[0] > 90 and cycle.open_percent[0] < 3 for cycle in cycles)
    assert "index: range" in result.output


def test_a_guarded_hand_closes_as_often_as_it_should(tmp_path):
    with open_target(guarded=True) as target:
        run_endurance(target, 3, tmp_path / "cycles.jsonl")
    assert len(read_cycles(tmp_path / "cycles.jsonl")) == 3


def test_a_last_line_that_was_cut_is_passed_over_and_replaced(tmp_path):
    log = tmp_path / "cycles.jsonl"
    assert run(log, 2).exit_code == 0
    whole = log.read_text()
    log.write_text(whole[:-40])
    assert len(read_cycles(log)) == 1
    assert run(log, 2).exit_code == 0
    assert len(read_cycles(log)) == 2


def test_ctrl_c_leaves_a_summary(tmp_path, monkeypatch):
    def interrupted(target, cycles, log, *, progress):
        run_endurance(target, 2, log)
        raise KeyboardInterrupt

    monkeypatch.setattr("hil.cli.endurance.run_endurance", interrupted)
    result = CliRunner().invoke(main, ["endurance", "--cycles", "50", "--log", str(tmp_path / "cycles.jsonl")])
    assert result.exit_code == 130
    assert "2 cycles in" in result.output
    assert "thumb_flexor: range" in result.output


def test_a_cycle_needs_every_channel(tmp_path):
    log = tmp_path / "cycles.jsonl"
    log.write_text('{"closed_percent": [1], "open_percent": [1], "closing_current": [1], "temperature": [1]}\n')
    with pytest.raises(ValueError, match="needs 7 finite numbers"):
        read_cycles(log)


def test_a_file_of_something_else_is_not_appended_to(tmp_path):
    log = tmp_path / "notes.txt"
    log.write_text("shopping list\n")
    result = run(log, 2)
    assert result.exit_code == 2
    assert "line 1" in result.output
    assert log.read_text() == "shopping list\n"


@given(st.integers(2, 60), st.floats(-5, 5), st.floats(-1, 1))
def test_a_steady_drift_comes_out(n, range_drift, current_drift):
    cycles = [
        Cycle([90.0 + range_drift * i / (n - 1)] * 7, [1.0] * 7, [2.0 + current_drift * i / (n - 1)] * 7, [30.0] * 7)
        for i in range(n)
    ]
    kept = 1 - (max(1, round(0.1 * n)) - 1) / (n - 1)  # between the middles of the first and the last tenth
    row = drift(cycles)["ring"]
    assert row["range_drift"] == pytest.approx(range_drift * kept, abs=1e-9)
    assert row["current_drift"] == pytest.approx(current_drift * kept, abs=1e-9)


def test_one_cycle_has_no_drift():
    with pytest.raises(ValueError, match="needs two"):
        drift([Cycle([0.0] * 7, [0.0] * 7, [0.0] * 7, [0.0] * 7)])


@pytest.mark.skipif(not available, reason="needs a limit on the size of files")
def test_a_full_disk_is_no_hand_and_no_usage(tmp_path):
    log = tmp_path / "cycles.jsonl"
    with full_disk(100):
        ended = run(log, 2)
    assert ended.exit_code == 5
    assert "cycles.jsonl" in ended.output
    assert run(log, 2).exit_code == 0
