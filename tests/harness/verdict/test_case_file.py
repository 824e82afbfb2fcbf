"""A case is put down and taken up as it was; a damaged file is refused in one line."""

import json
import re
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import Channel
from hil.recordings.errors import UnusableFileError
from hil.report.page import render_case
from hil.verdict.case import DiagnosisCase, Done, Proposal
from hil.verdict.case_file import CASE, HandOfCase, StoredCase, case_of, read_case, table_of, write_case
from hil.verdict.case_words import MEND, came_of, conclusion, why
from hil.verdict.failures import Failures
from hil.verdict.parts import Part, Suspect
from hil.verdict.steps import StepOutcome, steps

HAND = HandOfCase("0.1.5", "left", "bench-left", "A1")
CASE_OF_RING = DiagnosisCase(
    Failures({("staircase", "friction", "ring"): 3.0}),
    {Suspect(Part.SERVO, Channel.RING): 0.6, Suspect(Part.DIGIT, Channel.RING): 0.3, Suspect(Part.SETUP): 0.1},
    ("staircase",),
    ("presence", "staircase"),
)
MOVED = CASE_OF_RING.after(Proposal(steps()["home"]), StepOutcome.STAYS).after(
    Proposal(steps()["exchange"], Channel.RING, Channel.PINKY), StepOutcome.MOVED, "both have one label"
)


@given(
    st.lists(
        st.tuples(st.sampled_from(sorted(steps())), st.sampled_from([None, *Channel]), st.sampled_from(StepOutcome)),
        max_size=5,
    )
)
def test_a_case_is_taken_up_as_it_was_put_down(done):
    case = CASE_OF_RING
    for name, at, outcome in done:
        case = case.after(Proposal(steps()[name], at, at), outcome, "a note")
    stored = StoredCase(case, HAND, {"a question": "yes"})
    assert case_of(json.loads(json.dumps(table_of(stored)))) == stored


@pytest.mark.parametrize("text", ["", "[]", "null", "{", '{"experiments": ["none"]}', "[" * 9999, '{"experiments": 3}'])
def test_a_damaged_case_is_refused_in_one_line(text, tmp_path):
    (tmp_path / CASE).write_text(text)
    with pytest.raises(UnusableFileError, match="case"):
        read_case(tmp_path)


def test_a_folder_without_a_case_says_what_opens_one(tmp_path):
    with pytest.raises(UnusableFileError, match="`validate` opens one"):
        read_case(tmp_path)


def test_page_and_words_show_the_part_and_the_chain(tmp_path):
    write_case(tmp_path, StoredCase(MOVED, HAND))
    case = read_case(tmp_path).case
    assert case.convicted == Suspect(Part.SERVO, Channel.RING)
    assert conclusion(case) == "Servo of the ring finger, which is now at the pinky finger. Replace this servo."
    page = render_case(case)
    said = ("Replace this servo.", "let it home", "The failure went along (both have one label).")
    assert all(text in page for text in said)
    assert "http" not in page


def test_replace_is_said_of_no_part_that_no_step_convicted():
    assert "eplace" not in conclusion(CASE_OF_RING)
    assert "eplace" not in render_case(CASE_OF_RING)
    assert MEND.keys() == set(Part)


@pytest.mark.parametrize(
    ("name", "outcome", "heading", "linked"),
    [
        ("home", StepOutcome.GONE, "The failure is gone", True),
        ("home", StepOutcome.STAYS, "Open case", True),
        ("look", StepOutcome.SEEN, "At fault", False),
        ("look", StepOutcome.STAYS, "Open case", True),
    ],
)
def test_the_heading_is_what_the_case_came_to_and_each_run_is_linked(name, outcome, heading, linked):
    page = render_case(CASE_OF_RING.after(Proposal(steps()[name], Channel.RING, Channel.PINKY), outcome))
    assert f"{heading}</h1>" in page
    assert ("step-1/report.html" in page) is linked


def test_a_part_for_which_nothing_speaks_is_not_listed():
    suspects = {**CASE_OF_RING.suspects, Suspect(Part.BUS): 0.0}
    page = render_case(replace(CASE_OF_RING, suspects=suspects))
    assert "servo of the ring finger" in page
    assert " 0\u00a0%" not in page


@pytest.mark.parametrize("step", steps().values(), ids=lambda step: step.name)
def test_every_step_says_why_in_whole_sentences(step):
    said = why(CASE_OF_RING, Proposal(step, Channel.RING, Channel.PINKY))
    assert not re.search(r"If[ ;]*\.", said)
    assert said.endswith(".")


def test_what_was_answered_is_said_with_what_came_of_it():
    look = Proposal(steps()["look"], Channel.RING, Channel.PINKY)
    assert came_of(Done(look, StepOutcome.STAYS, "alike")).endswith("? No; the failure stays (alike).")
    assert came_of(Done(look, StepOutcome.SEEN)).endswith("? Yes.")
    assert came_of(Done(Proposal(steps()["power"]), StepOutcome.GONE)).endswith(". The failure is gone.")
