"""The text of a run says what the page says, in its order."""

import io
import re
from dataclasses import replace

import pytest
from rich.console import Console

from aero.channels import Channel
from hil.checks import EXPERIMENTS
from hil.report.text import run_text
from hil.verdict.diagnosis import Diagnosis, NextStep
from hil.verdict.findings import failed
from hil.verdict.parts import Part, Suspect


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
        {Suspect(Part.DIGIT, Channel.RING): 1.0}, ("the ring is off",),
        (spoken,), (other,), step=NextStep("Pull at the cable.", "aero-hil validate"),
        observations=("Ring: it draws 3.0 times the other fingers' current",),
    )  # fmt: skip
    return replace(run, diagnosis=diagnosis)


@pytest.mark.parametrize("width", [60, 80])
def test_a_failed_run_says_verdict_and_place_then_evidence_test_and_other_findings(broken, width):
    said = " ".join(printed(broken, width).split())
    order = (
        "Out of limits: ring finger", "The ring is off. Suspected: digit", "observed Ring: it draws",
        "do this Pull at the cable.", "aero-hil validate",
        "evidence Ring finger", "other Ring finger", "presence", "out of limits: ring finger; 2 of ",
    )  # fmt: skip
    places = [said.index(text) for text in order]
    assert places == sorted(places)


def test_the_count_is_that_of_the_page_and_the_files(validated):
    tally = validated.tally
    assert tally.failed == 0
    assert f"all {tally.passed} checks passed" in printed(validated, 200)
    assert tally.passed == len(validated.findings)
    said = printed(validated, 200)
    assert sum(map(int, re.findall(r": (\d+) checks passed", said))) == tally.passed


def test_each_experiment_takes_about_as_long_as_is_said_before_a_hand_moves(validated):
    for name, result in validated.results.items():
        assert result.recording.header.duration_s == pytest.approx(EXPERIMENTS[name].hand_s, rel=0.1, abs=1.0), name
