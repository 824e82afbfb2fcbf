"""One sentence a channel says what was measured, strongest first, and names no cause."""

from dataclasses import replace

import pytest

from hil.checks import EXPERIMENTS
from hil.emulated.any_hand import open_target
from hil.emulated.faults import parse_fault
from hil.verdict.findings import NotJudgedReason, failed
from hil.verdict.judged_run import Validation
from hil.verdict.limits import Limit
from hil.verdict.motion import still_channels
from hil.verdict.run_end import FINISHED
from hil.verdict.sentences import LENGTH, channel_sentences
from hil.verdict.validation import validate


@pytest.fixture(scope="module")
def dead():
    with open_target(seed=1, faults=[parse_fault("motor_dead:ring")]) as target:
        return validate(target, ["audit", "excursion", "response", "staircase", "replay"])


@pytest.fixture(scope="module")
def validated():
    with open_target(seed=1, homed=True) as target:
        return validate(target, ["staircase"])


def test_a_channel_without_motion_is_one_sentence(dead):
    first = channel_sentences(dead)[0]
    assert first.startswith("Ring finger: does not move (0 % of a nudge, 0 mm of ")
    assert "draws no current (0.00 A of " in first


def test_what_needs_motion_is_not_judged_on_a_channel_without(dead):
    off = {(finding.check, finding.subject) for finding in failed(dead.findings)}
    gone = {(one.metric, one.subject) for one in dead.withheld if one.why is NotJudgedReason.NO_MOTION}
    for metric in ("rise_hand_ms", "take_up", "replay_delay", "friction"):
        assert (metric, "ring") in gone
        assert (metric, "ring") not in off
    assert ("command_to_motion", "hand") in gone
    assert {subject for _, subject in gone} == {"ring", "hand"}


def test_a_channel_without_motion_makes_no_other_servo_warm():
    """Homing warms the servos that move, and five good fingers were said to be too warm beside a dead motor."""
    with open_target(seed=1, homed=True, faults=[parse_fault("motor_dead:ring")]) as target:
        run = validate(target, ["presence", "audit"])
    assert run.alike is not None
    assert not run.alike.findings
    assert {finding.subject for finding in failed(run.findings)} == {"ring"}


@pytest.mark.parametrize(("followed", "travel", "still"), [(0.0, 0.0, True), (4.0, 1.0, True), (0.0, 44.0, False)])
def test_a_channel_is_without_motion_if_no_measurement_shows_any(followed, travel, still):
    limits = (
        Limit("audit", "followed", ("ring",), at_least=90.0, healthy=(95.0, 99.0)),
        Limit("staircase", "excursion_hand", ("ring",), at_least=40.0, healthy=(42.0, 45.0)),
    )
    numbers = {"audit": {"ring": {"followed": followed}}, "staircase": {"ring": {"excursion_hand": travel}}}
    assert bool(still_channels(numbers, limits)) is still
    assert not still_channels({}, limits)


def test_a_second_reading_of_one_kind_adds_nothing(validated):
    result = validated.results["staircase"]
    bad = tuple(
        replace(one, passed=False, excess=5.0) if one.subject == "index" and one.check in names else one
        for one in result.findings
        if (names := ("tracking_rms", "excursion_hand", "friction"))
    )
    (sentence,) = channel_sentences(Validation({"staircase": replace(result, findings=bad)}, FINISHED, 0.0))
    metrics = {name: EXPERIMENTS["staircase"].metric(name, "index").words for name in ("tracking_rms", "friction")}
    assert metrics["tracking_rms"] in sentence
    assert metrics["friction"] in sentence
    assert "travel when swept alone" not in sentence
    assert len(sentence) <= LENGTH + 80


def test_channels_that_fail_one_check_alone_share_a_sentence(validated):
    result = validated.results["staircase"]
    bad = tuple(
        replace(one, passed=False, excess=5.0)
        if one.check == "friction" and one.subject in {"index", "ring", "pinky"}
        else one
        for one in result.findings
    )
    (sentence,) = channel_sentences(Validation({"staircase": replace(result, findings=bad)}, FINISHED, 0.0))
    assert sentence.startswith("Index finger and 2 more: friction")
    two = tuple(replace(one, passed=True) if one.subject == "pinky" else one for one in bad)
    (sentence,) = channel_sentences(Validation({"staircase": replace(result, findings=two)}, FINISHED, 0.0))
    assert sentence.startswith("Index finger and ring finger: friction")


def test_readings_above_and_below_their_limits_are_two_sentences(validated):
    result = validated.results["staircase"]
    excess = {"index": 5.0, "ring": -5.0, "pinky": -3.0}
    bad = tuple(
        replace(one, passed=False, excess=excess[one.subject])
        if one.check == "friction" and one.subject in excess
        else one
        for one in result.findings
    )
    sentences = channel_sentences(Validation({"staircase": replace(result, findings=bad)}, FINISHED, 0.0))
    assert [text.partition(":")[0] for text in sentences] == ["Index finger", "Ring finger and pinky finger"]


@pytest.mark.parametrize(
    ("measured", "expected", "words"),
    [
        ("1 restarts", "at most 0 restarts", "1, should be at most 0 restarts"),
        ("99.2 % of the window", "81 to 97.2 % of the window", "99.2, should be 81 to 97.2 % of the window"),
        ("100 %, at the end of the window", "81 to 97 %", "100 %, at the end of the window, should be 81 to 97 %"),
        ("moved", "stays", "moved, should be stays"),
    ],
)
def test_a_unit_is_said_once(validated, measured, expected, words):
    bad = replace(validated.results["staircase"].findings[0], passed=False, measured=measured, expected=expected)
    result = replace(validated.results["staircase"], findings=(bad,))
    (sentence,) = channel_sentences(Validation({"staircase": result}, FINISHED, 0.0))
    assert sentence.endswith(f" {words}.")
