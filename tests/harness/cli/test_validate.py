"""The commands others script against: their exit codes, their files and what they print."""

import dataclasses
import json
import os
from contextlib import contextmanager

import pytest
from click.testing import CliRunner

from aero.exit_code import Exit
from aero.safety import SafetyStopError
from hil.checks import EXPERIMENTS
from hil.checks.staircase.check import Staircase, run_staircase
from hil.cli import main, validation_run
from hil.verdict import judge
from hil.verdict.case_file import read_case
from hil.verdict.limits import load_limits
from hil.verdict.part import Part
from hil.verdict.parts import Suspect
from simulator import RoutedHand

SHORT = Staircase(levels=3)


def run_short(monkeypatch, *arguments):
    """`aero-hil validate` on presence and a staircase of three levels."""

    def run(target, recorder, progress):
        run_staircase(target, recorder, RoutedHand(target.side), SHORT, progress=progress)

    def tracking_limits(firmware, *, guarded):
        """The others, and the thumb's, are made for twenty levels."""
        limits = load_limits(firmware, guarded=guarded)
        return tuple(limit for limit in limits if limit.metric == "tracking_rms" and "index" in limit.subjects)

    monkeypatch.setitem(EXPERIMENTS, "staircase", dataclasses.replace(EXPERIMENTS["staircase"], run=run))
    monkeypatch.setattr(judge, "load_limits", tracking_limits)
    selected = ["--only", "presence", "--only", "staircase"]
    return CliRunner().invoke(main, ["validate", *selected, *arguments], catch_exceptions=False)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """One run for all tests that look at what it leaves."""
    out = tmp_path_factory.mktemp("validate")
    with pytest.MonkeyPatch.context() as monkeypatch:
        return run_short(monkeypatch, "--seed", "7", "--out", str(out)), out


@pytest.mark.slow
@pytest.mark.parametrize(("firmware", "side"), [("pre", "left"), ("0.2.0", "right")])
def test_the_emulated_hand_is_within_limits(tmp_path, firmware, side):
    arguments = ["validate", "--firmware", firmware, "--side", side, "--out", str(tmp_path)]
    result = CliRunner().invoke(main, arguments, catch_exceptions=False)
    assert result.exit_code == 0, result.output


def test_the_verdict_is_printed(results):
    result, out = results
    assert result.exit_code == 0, result.output
    assert "within limits" in result.output
    assert "presence" in result.output
    assert str(out / "report.html") in result.output.replace("\n", "")


def test_every_measurement_and_finding_is_in_checks_json(results):
    _, out = results
    checks = json.loads((out / "checks.json").read_text())
    assert checks["passed"] is True
    assert set(checks["measured"]) == {"presence", "staircase", "session", "driver", "alike"}
    assert checks["measured"]["presence"]["hand"]["lost_replies"] == 0.0
    assert {finding["check"] for finding in checks["findings"]} == {"tracking_rms"}


def test_out_of_limits_is_exit_1(tmp_path):
    unit = tmp_path / "hot.toml"
    unit.write_text("[servos]\nstart_temperature_c = 67.0\n")
    arguments = ["validate", "--only", "presence", "--unit", str(unit), "--out", str(tmp_path)]
    result = CliRunner().invoke(main, arguments, catch_exceptions=False)
    assert result.exit_code == 1, result.output
    assert "emperature 6" in " ".join(result.output.split())
    assert "Out of limits" in (tmp_path / "report.html").read_text()


def test_a_fault_is_put_into_an_emulated_hand(tmp_path):
    arguments = ["validate", "--only", "audit", "--fault", "motor_dead:ring", "--out", str(tmp_path)]
    result = CliRunner().invoke(main, arguments, catch_exceptions=False)
    assert result.exit_code == 1, result.output
    said = " ".join(result.output.split())
    assert "Ring finger: motion after a nudge 0, should be" in said
    assert said.index("Out of limits") < said.index("Ring finger: ") < said.index("Suspected: servo of the ring finger")


def test_a_fault_without_effect_is_exit_2_and_no_verdict_and_the_report_is_there(tmp_path):
    arguments = ["validate", "--only", "presence", "--fault", "motor_dead:ring@90", "--out", str(tmp_path)]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 2, result.output
    assert "motor_dead:ring" in result.output
    assert not json.loads((tmp_path / "checks.json").read_text())["passed"]
    report = (tmp_path / "report.html").read_text()
    assert "Never fired: motor_dead:ring=1.0@90.0" in report
    assert "The measured values are of a hand without the fault." in report


def test_a_hand_that_may_not_be_open_at_the_end_is_not_within_limits(monkeypatch, tmp_path):
    open_hand = validation_run.open_hand

    @contextmanager
    def stays_closed(hand, **fields):
        with open_hand(hand, **fields) as target:
            yield target
        raise SafetyStopError("it may still be closed.")

    monkeypatch.setattr(validation_run, "open_hand", stays_closed)
    run = CliRunner().invoke(main, ["validate", "--only", "presence", "--out", str(tmp_path)])
    assert run.exit_code == 4  # docs/commands.md
    assert run.output.count("it may still be closed.") == 1
    checks = json.loads((tmp_path / "checks.json").read_text())
    assert "It may still be closed." in json.dumps(checks["findings"])
    page = (tmp_path / "report.html").read_text()
    assert "It may still be closed." in page
    assert "Within limits" not in page


def test_a_hand_on_a_port_that_does_not_answer_gets_a_case(tmp_path):
    board, port = os.openpty()
    arguments = ["validate", "--hil", os.ttyname(port), "--only", "presence", "--out", str(tmp_path)]
    try:
        result = CliRunner().invoke(main, arguments)
    finally:
        os.close(board)
        os.close(port)
    assert result.exit_code == Exit.NO_HAND
    assert f"aero-hil diagnose {tmp_path} --hil" in " ".join(result.stdout.split())
    assert "no reply to GET_POS" in result.stderr
    (group,) = read_case(tmp_path).case.opened
    assert {Suspect(Part.USB), Suspect(Part.BOARD), Suspect(Part.COMPUTER)} <= group.strong


def test_a_port_that_does_not_exist_gets_no_case(tmp_path):
    result = CliRunner().invoke(main, ["validate", "--hil", str(tmp_path / "nowhere"), "--out", str(tmp_path / "out")])
    assert result.exit_code == Exit.NO_HAND
    assert not (tmp_path / "out").exists() or not any((tmp_path / "out").iterdir())
