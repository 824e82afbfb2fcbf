"""A case is put down and taken up as it was; a damaged file is refused in one line."""

import json
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import Channel
from hil.recordings.errors import UnusableFileError
from hil.report.page import render_case
from hil.verdict.case import DiagnosisCase, Done
from hil.verdict.case_file import CASE, HandOfCase, StoredCase, case_of, read_case, table_of, write_case
from hil.verdict.case_words import conclusion, outcome_text, why
from hil.verdict.failures import Failures
from hil.verdict.group import AmbiguityGroup, Proposal
from hil.verdict.part import Part
from hil.verdict.parts import Suspect
from hil.verdict.steps import StepOutcome, steps

HAND = HandOfCase("0.1.5", "left", "bench-left", "A1")
GROUP = AmbiguityGroup(
    Failures({("staircase", "friction", "ring"): 3.0}),
    frozenset({Suspect(Part.SERVO, Channel.RING), Suspect(Part.DIGIT, Channel.RING), Suspect(Part.SETUP)}),
    frozenset({Suspect(Part.BOARD)}),
    "readings of the ring finger are off",
)
CASE_OF_RING = DiagnosisCase(
    (GROUP,),
    ("presence", "staircase"),
    ("presence", "staircase", "replay"),
)
MOVED = CASE_OF_RING.after(Proposal(steps()["home"]), StepOutcome.STAYS).after(
    Proposal(steps()["exchange"], Channel.RING, Channel.PINKY), StepOutcome.MOVED, "both have one label"
)


@given(
    st.lists(
        st.tuples(st.sampled_from(sorted(steps())), st.sampled_from(Channel), st.randoms(use_true_random=False)),
        max_size=5,
    )
)
def test_a_case_is_taken_up_as_it_was_put_down(done):
    case = CASE_OF_RING
    for name, channel, random in done:
        step = steps()[name]
        at = channel if step.of_one_channel else None
        case = case.after(Proposal(step, at, at), random.choice(step.outcomes), "a note")
    stored = StoredCase(case, HAND, {"a question": "yes"}, "2026-01-31 08:05")
    assert case_of(json.loads(json.dumps(table_of(stored)))) == stored


def edited(**changes):
    table = json.loads(json.dumps(table_of(StoredCase(MOVED, HAND)))) | changes
    of_group = {key: table.pop(key) for key in ("failed", "strong") if key in changes}
    table["groups"][0].update(of_group)
    return json.dumps(table)


FOREIGN = {
    "not a number": edited(failed=[["staircase", "friction", "ring", float("nan")]]),
    "infinite": edited(failed=[["staircase", "friction", "ring", 1e999]]),
    "unknown reading": edited(failed=[["staircase", "smell", "ring", 3.0]]),
    "unknown subject": edited(failed=[["staircase", "friction", "toe", 3.0]]),
    "reading without an excess": edited(failed=[["staircase", "friction", "ring"]]),
    "list as a key": edited(failed=[[["staircase"], "friction", "ring", 3.0]]),
    "unknown part": edited(strong=[["TOE", None]]),
    "unknown channel": edited(strong=[["SERVO", "toe"]]),
    "unknown outcome": edited(steps=[{"step": "home", "at": None, "beside": None, "outcomes": ["SEEN"], "note": ""}]),
    "outcome of another step": edited(
        steps=[{"step": "home", "at": None, "beside": None, "outcomes": ["YES"], "note": ""}]
    ),
    "step at no place": edited(
        steps=[{"step": "exchange", "at": None, "beside": None, "outcomes": ["MOVED"], "note": ""}]
    ),
    "step of another version": edited(
        steps=[{"step": "look", "at": "ring", "beside": "pinky", "outcomes": ["STAYS"], "note": ""}]
    ),
    "outcomes of other groups": edited(
        steps=[{"step": "home", "at": None, "beside": None, "outcomes": ["GONE", "STAYS"], "note": ""}]
    ),
    "unknown experiment": edited(planned=["tea"]),
    "number for a list": edited(steps=3),
    "no suspects": edited(strong=None),
}


@pytest.mark.parametrize("name", FOREIGN)
def test_a_case_that_was_edited_or_is_of_another_version_is_refused_in_one_line(name, tmp_path):
    (tmp_path / CASE).write_text(FOREIGN[name])
    with pytest.raises(UnusableFileError, match="is not a case of this version") as refused:
        read_case(tmp_path)
    assert "\n" not in str(refused.value)


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
    assert case.told == (Suspect(Part.SERVO, Channel.RING),)
    assert conclusion(case) == (
        "Servo of the ring finger, which is now at the pinky finger. Replace this servo. "
        "If its registers differ from its neighbours', setting them alike may do."
    )
    page = render_case(read_case(tmp_path))
    said = ("Replace this servo.", "let the hand home", "The failure went along (both have one label).")
    assert all(text in page for text in said)
    assert "http" not in page


def test_replace_is_said_of_no_part_that_no_step_convicted():
    assert "eplace" not in conclusion(CASE_OF_RING)
    assert "eplace" not in render_case(StoredCase(CASE_OF_RING, HAND))


@pytest.mark.parametrize(
    ("name", "outcome", "heading", "linked"),
    [
        ("home", StepOutcome.GONE, "The failure is gone", True),
        ("home", StepOutcome.STAYS, "Open case", True),
        ("exchange", StepOutcome.MOVED, "At fault", True),
        ("bend", StepOutcome.NO, "Open case", False),
        ("exchange", StepOutcome.SKIPPED, "Open case", False),
    ],
)
def test_the_heading_is_what_the_case_came_to_and_each_run_is_linked(name, outcome, heading, linked):
    case = CASE_OF_RING.after(Proposal(steps()[name], Channel.RING, Channel.PINKY), outcome)
    page = render_case(StoredCase(case, HAND))
    assert f"{heading}</h1>" in page
    assert ("step-1/report.html" in page) is linked


def test_a_wrong_version_is_nothing_broken_on_a_page_that_names_the_hand_and_the_next_command():
    """The page said "At fault" in red above "Nothing is broken"."""
    off = Failures({("presence", "firmware", "hand"): 3.0})
    group = AmbiguityGroup(
        off, frozenset({Suspect(Part.SETUP), Suspect(Part.BOARD)}), seen="it reads as another version"
    )
    case = DiagnosisCase((group,), ("presence",), ("presence",))
    case = case.after(Proposal(steps()["version"]), StepOutcome.YES)
    case = case.after(Proposal(steps()["flash"]), StepOutcome.SKIPPED)
    again = "aero-hil validate --hil bench-left --firmware VERSION --side SIDE"
    page = render_case(StoredCase(case, HAND, date="2026-01-31 08:05"), again)
    assert "Nothing is broken: name the version" in conclusion(case)
    assert "Nothing is broken</h1>" in page
    assert "At fault" not in page
    assert 'class="verdict fail"' not in page
    assert all(text in page for text in (again, "2026-01-31 08:05", "left, bench-left", "0.1.5"))


@pytest.mark.parametrize("step", steps().values(), ids=lambda step: step.name)
def test_every_step_says_why_in_whole_sentences(step):
    said = why(CASE_OF_RING, Proposal(step, Channel.RING, Channel.PINKY))
    assert not re.search(r"If[ ;]*\.", said)
    assert said.endswith(".")


def test_what_was_answered_is_said_with_what_came_of_it():
    bend = Proposal(steps()["bend"], Channel.RING, Channel.PINKY)
    assert outcome_text(Done(bend, (StepOutcome.NO,), "alike")).endswith("? No (alike).")
    assert outcome_text(Done(bend, (StepOutcome.YES,))).endswith("? Yes.")
    assert outcome_text(Done(Proposal(steps()["power"]), (StepOutcome.GONE,))).endswith(". The failure is gone.")
