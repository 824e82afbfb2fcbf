"""What a judged run says about itself, on runs made by hand."""

from dataclasses import replace

import numpy as np
import pytest

from aero.safety import SafetyReason, SafetyStopError
from hil.recordings.recording import Recording, Series
from hil.verdict.findings import Finding, NotJudgedReason, Withheld, failed
from hil.verdict.judge import Judge, without_withheld
from hil.verdict.judged_run import Result, Validation
from hil.verdict.run_end import FINISHED, EndKind, RunEnd
from tests.support.synthetic import HEADER, LABELS

GOOD = Finding("friction", "ring", True, "0.2 A", "at most 0.3 A", "test", "", "")
BAD = replace(GOOD, passed=False, measured="0.4 A")


def recording(seconds):
    return Recording(HEADER, {"codes": Series.of(LABELS, ["u16"] * 7, [0.0, seconds], np.zeros((2, 7)))})


def run(**changes):
    results = {
        "audit": Result(recording(9.0), {"ring": {"pull": 1.0}}, (GOOD,)),
        "holding": Result(recording(10.5), {}, ()),
    }
    return Validation(results, FINISHED, 1.0, **changes)


def test_a_run_passes_when_each_finding_of_every_kind_does():
    whole = Result(recording(20.0), {"hand": {"restarts": 0.0}}, (GOOD,))
    assert run().passed
    assert run(whole_run=whole, regressions=(GOOD,)).findings == (GOOD, GOOD, GOOD)
    assert not run(regressions=(BAD,)).passed
    assert not run(whole_run=replace(whole, findings=(BAD,))).passed
    stopped = RunEnd(EndKind.INCOMPLETE, "audit")
    assert not replace(run(), end=stopped).passed
    assert replace(run(), end=stopped).findings == (stopped.finding, GOOD)
    assert failed((GOOD, BAD, GOOD)) == (BAD,)


def test_numbers_are_those_of_what_could_be_measured():
    whole = Result(recording(20.0), {"hand": {"restarts": 0.0}}, ())
    assert run().numbers == {"audit": {"ring": {"pull": 1.0}}}
    assert run(whole_run=whole).numbers.keys() == {"audit", "session"}
    assert list(run(whole_run=whole).judged) == ["audit", "holding", "session"]
    assert run().measured("audit").measured == {"ring": {"pull": 1.0}}
    assert run().measured("holding") is None
    assert run().measured("coupling") is None


def test_hand_time_is_that_of_all_experiments():
    assert run().hand_seconds == pytest.approx(19.5)


def test_a_finding_is_a_sentence():
    assert BAD.sentence == "Ring finger: friction 0.4 A, should be at most 0.3 A"


def test_what_ended_a_run_says_itself_what_happened():
    end = RunEnd(EndKind.STOPPED, "audit", "two processes.", SafetyStopError("", SafetyReason.FORKED))
    diagnosis = Judge("0.2.0", guarded=True).diagnosis(Validation({}, end, 1.0))
    assert (diagnosis.place, diagnosis.sentence) == ("", "")
    assert diagnosis.step.do == end.finding.remedy


def test_a_reading_that_was_not_judged_is_evidence_of_nothing():
    measured = {"ring": {"rise_hand_ms": 90.0, "spring": 1.0}, "hand": {}}
    withheld = [
        Withheld("staircase", "rise_hand_ms", "ring", "rise", NotJudgedReason.LATE_THROUGHOUT),
        Withheld("excursion", "spring", "ring", "load", NotJudgedReason.LATE_THROUGHOUT),
    ]
    assert without_withheld(measured, "staircase", withheld) == {"ring": {"spring": 1.0}, "hand": {}}


def test_a_check_that_could_not_be_measured_is_counted_as_neither_passed_nor_failed():
    lost = replace(GOOD, passed=False, excess=None)
    done = replace(run(), results={"audit": Result(recording(9.0), {}, (GOOD, lost))})
    assert not done.passed
    assert done.tally.words == "1 of 2 checks passed, 1 not measurable"
