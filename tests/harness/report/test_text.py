"""The text of a run fits on one screen, in its order."""

import io
import re
from dataclasses import replace

import pytest
from rich.console import Console

from aero.channels import Channel
from aero.errors import LinkTimeoutError
from hil.checks import DEFAULT, EXPERIMENTS
from hil.report.page import verdict_of
from hil.report.text import SCREEN, result_line, run_text
from hil.verdict.diagnosis import Diagnosis, NextStep
from hil.verdict.findings import failed
from hil.verdict.part import Part
from hil.verdict.parts import Suspect
from hil.verdict.run_end import EndKind, RunEnd


def printed(run, width):
    said = io.StringIO()
    console = Console(width=width, file=said, color_system=None, markup=False, highlight=False)
    for line in run_text(run, "out/report.html"):
        console.print(line)
    return said.getvalue()


@pytest.fixture(scope="module")
def broken(validated):
    """The run with two failed findings, one of which the diagnosis explains."""
    result = validated.results["staircase"]
    bad = [
        replace(finding, passed=False) if finding.subject == "ring" and finding.check in names else finding
        for finding in result.findings
        if (names := ("friction", "take_up"))
    ]
    run = replace(validated, results={**validated.results, "staircase": replace(result, findings=tuple(bad))})
    spoken, other = failed(run.findings)
    diagnosis = Diagnosis(
        (Suspect(Part.DIGIT, Channel.RING),), ("the ring is off",),
        (spoken,), (other,), step=NextStep("Pull at the cable.", "aero-hil validate"),
    )  # fmt: skip
    return replace(run, diagnosis=diagnosis)


@pytest.mark.parametrize("width", [60, 80])
def test_a_failed_run_says_verdict_channels_suspects_step_and_report(broken, width):
    said = " ".join(printed(broken, width).split())
    order = (
        "Out of limits; 2 of ", "Ring finger: ", "Suspected: digit of the ring finger; no test",
        "Next: Pull at the cable.", "aero-hil validate", "Report: out/report.html",
    )  # fmt: skip
    places = [said.index(text) for text in order]
    assert places == sorted(places)
    assert "presence" not in said


def test_a_run_that_fails_everywhere_fits_on_one_screen(validated):
    results = {
        name: replace(result, findings=tuple(replace(one, passed=False, excess=9.0) for one in result.findings))
        for name, result in validated.results.items()
        if name in DEFAULT
    }
    everywhere = Diagnosis(
        tuple(Suspect(part) for part in Part if part not in (Part.DIGIT, Part.SERVO)),
        ("several digits fail",), step=NextStep("Switch the supply off. " * 8, "aero-hil diagnose validation/latest"),
    )  # fmt: skip
    said = printed(replace(validated, results=results, diagnosis=everywhere), 80)
    assert len(said.splitlines()) + len(results) <= SCREEN
    assert re.search(r"^and \d more$", said, re.MULTILINE)


def test_a_conclusion_without_a_channel_is_said_once(broken):
    clue = "it reads as firmware 0.1.5, or as a board not homed"
    shared = replace(broken, diagnosis=Diagnosis((Suspect(Part.SETUP), Suspect(Part.BOARD)), (clue,)))
    said = " ".join(printed(shared, 80).split())
    assert "It reads as firmware 0.1.5, or as a board not homed. Suspected: set-up or board" in said
    assert "ring is off" not in printed(broken, 200)


def test_the_reason_of_an_error_is_left_to_standard_error(validated):
    error = LinkTimeoutError("no reply to GET_POS within 1 s")
    said = printed(replace(validated, end=RunEnd(EndKind.LINK, "audit", str(error), error)), 80)
    assert said.startswith("Aborted; all ")
    assert "\nAudit aborted.\n" in said
    assert "no reply" not in said


def test_the_line_of_an_experiment_counts_no_failures(validated):
    findings = validated.results["staircase"].findings
    assert str(result_line("staircase", findings)).endswith(f": {len(findings)} checks passed")
    assert str(result_line("staircase", (*findings, replace(findings[0], passed=False)))).endswith(": failed")
    assert str(result_line("coupling", ())).endswith(": not judged")


def test_a_servo_without_a_channel_is_one_of_them():
    assert str(Suspect(Part.SERVO)) == "one of the servos"
    assert str(Suspect(Part.SERVO, Channel.RING)) == "servo of the ring finger"
    assert str(Suspect(Part.BUS)) == Part.BUS.value


def test_a_gate_says_its_reason(validated):
    said = " ".join(printed(replace(validated, end=RunEnd(EndKind.GATE, "presence")), 80).split())
    assert "Motion through the range not run: Checks of presence failed." in said


@pytest.mark.parametrize(
    ("kind", "verdict"),
    [
        (EndKind.LINK, "aborted"), (EndKind.GATE, "fail"), (EndKind.NOT_PERMITTED, "unclear"),
        (EndKind.STOPPED, "stopped"), (EndKind.FINISHED, "pass"),
    ],
)  # fmt: skip
def test_a_run_that_an_error_ends_is_not_out_of_limits(validated, kind, verdict):
    assert verdict_of(replace(validated, end=RunEnd(kind, "audit"))) == verdict


def test_the_count_is_that_of_the_page_and_the_files(validated):
    tally = validated.tally
    assert tally.failed == 0
    assert f"all {tally.passed} checks passed" in printed(validated, 200)
    assert tally.passed == len(validated.findings)


def test_each_experiment_takes_about_as_long_as_is_said_before_a_hand_moves(validated):
    for name, result in validated.results.items():
        assert result.recording.header.duration_s == pytest.approx(EXPERIMENTS[name].hand_s, rel=0.1, abs=1.0), name
