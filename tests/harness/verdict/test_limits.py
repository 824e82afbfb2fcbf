"""Limits are read, refused and applied as their files say."""

import math
from dataclasses import replace
from functools import cache
from itertools import permutations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.firmware import FIRMWARE
from hil.checks import BOUNDS, EXPERIMENTS
from hil.verdict.findings import MissingReadingError, NotJudgedReason, failed
from hil.verdict.limits import TABLE as SHIPPED
from hil.verdict.limits import Limit, compare, limits_text, load_limits, out_of_limits, parse_limits, within_limits
from train.limits.compute import FEWEST, FURTHEST
from train.limits.resolution import resolution

TABLE = Limit("staircase", "tracking_rms", ("index", "ring"), at_most=0.9, given_by="paper")
ROW = {
    "experiment": "staircase",
    "metric": "tracking_rms",
    "subjects": "index ring",
    "firmware": "0.2.0 main",
    "guarded": "yes",
    "healthy_from": "0.1",
    "healthy_to": "0.5",
    "at_least": "",
    "at_most": "0.9",
    "readings": "12",
}

TRACKING = EXPERIMENTS["staircase"].metric("tracking_rms", "index")


@given(st.floats(-10, 10), st.floats(0.01, 10), st.floats(-30, 30))
def test_a_value_passes_exactly_within_the_bound(low, width, value):
    limit = replace(TABLE, at_least=low, at_most=low + width)
    assert limit.judge(TRACKING, "index", value).passed == (low <= value <= low + width)


def test_a_value_that_could_not_be_measured_is_neither_within_its_limits_nor_on_a_side_of_them():
    finding = TABLE.judge(TRACKING, "index", math.nan)
    assert not finding.passed
    assert finding.sentence == "Index finger: tracking error not measurable, should be at most 0.9 mm"
    assert finding.excess is None
    assert not within_limits(finding.excess)
    assert not out_of_limits(finding.excess)


def test_each_subject_of_the_experiment_is_compared():
    other = replace(TABLE, experiment="latency", subjects=("hand",))
    measured = {"index": {"tracking_rms": 0.5}, "ring": {"tracking_rms": 1.5}}
    findings, withheld = compare(EXPERIMENTS["staircase"], measured, (TABLE, other), lambda *_: 0.0)
    assert withheld == ()
    assert [finding.subject for finding in findings] == ["index", "ring"]
    assert [finding.subject for finding in failed(findings)] == ["ring"]


RISE = replace(TABLE, metric="rise_hand_ms", at_most=90.0)


def test_a_number_whose_samples_came_late_is_not_judged_and_one_that_is_not_measurable_does_not_pass():
    measured = {"index": {}, "ring": {"rise_hand_ms": math.nan}}
    findings, withheld = compare(
        EXPERIMENTS["staircase"], measured, (RISE,), lambda *_: 0.0, NotJudgedReason.LATE_THROUGHOUT
    )
    late = "Index finger: rise time was not judged: this computer or its link was late throughout"
    assert [one.sentence for one in withheld] == [late]
    assert [(finding.subject, finding.passed) for finding in findings] == [("ring", False)]


@pytest.mark.parametrize(("limit", "why"), [(RISE, None), (TABLE, NotJudgedReason.LATE_THROUGHOUT)])
def test_a_reading_that_nothing_excuses_is_a_defect(limit, why):
    """Where nothing was late, or for one that a late computer takes as well."""
    with pytest.raises(MissingReadingError, match=r"staircase did not measure .* of index"):
        compare(EXPERIMENTS["staircase"], {"ring": {}}, (limit,), lambda *_: 0.0, why)


def test_a_reading_out_of_limits_is_not_judged_where_the_computer_was_held_up():
    measured = {"index": {"tracking_rms": 5.0}, "ring": {"tracking_rms": 0.5}}
    findings, withheld = compare(EXPERIMENTS["staircase"], measured, (TABLE,), lambda *_: 0.08)
    assert [(finding.subject, finding.passed) for finding in findings] == [("ring", True)]
    assert [one.reason for one in withheld] == ["this computer was held up for 80 ms"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"colour": "red"}, "has the columns experiment, metric"),
        ({"subjects": "thumb"}, "subjects are some of"),
        ({"at_least": "1.0"}, "at_least is the lower"),
        ({"at_most": ""}, "at_least, at_most, or both"),
        ({"at_most": "much"}, "much"),
        ({"readings": ""}, "limit"),
    ],
)
def test_a_mistake_in_the_table_is_named(changes, message):
    row = {**ROW, **changes}
    with pytest.raises(ValueError, match=message):
        parse_limits("\n".join((",".join(row), ",".join(row.values()))))


def test_a_row_of_the_table_becomes_a_limit_and_is_written_as_it_was():
    text = "\n".join((",".join(ROW), ",".join(ROW.values()))) + "\n"
    (limit,) = parse_limits(text)
    assert limit == Limit(
        "staircase", "tracking_rms", ("index", "ring"), -math.inf, 0.9, ("0.2.0", "main"), True, (0.1, 0.5), 12
    )
    assert limits_text([limit]) == text


def test_the_limits_are_those_of_the_checks():
    """Change a bound or the population, then make the limits again with `python -m train.limits`."""
    for version in ("pre", "0.1.1", "0.1.2", "0.1.5", "0.2.0"):
        bounds = [bound for bound in BOUNDS if not bound.firmware or version in bound.firmware]
        limits = load_limits(version)
        found = {(limit.experiment, limit.metric, subject): limit for limit in limits for subject in limit.subjects}
        assert found.keys() == {(bound.experiment, bound.metric, s) for bound in bounds for s in bound.subjects}
        for bound in bounds:
            for subject in bound.subjects:
                limit = found[bound.experiment, bound.metric, subject]
                if bound.given:
                    assert (limit.at_least, limit.at_most) == (bound.at_least, bound.at_most)
                    continue
                assert math.isinf(limit.at_least) == (bound.side == "above"), limit
                assert math.isinf(limit.at_most) == (bound.side == "below"), limit
                for reading in bound.recorded or ():
                    assert limit.at_least < reading < limit.at_most, limit


def test_every_computed_limit_rests_on_enough_readings():
    few = [limit for limit in parse_limits(SHIPPED.read_text(encoding="utf-8")) if limit.readings < FEWEST]
    assert few == []


def test_no_limit_is_wider_than_its_readings_allow():
    """A limit that was moved by hand is one that no campaign gave."""
    bounds = {(bound.experiment, bound.metric, bound.subjects): bound for bound in BOUNDS}
    for version in ("pre", "0.1.1", "0.1.2", "0.1.5", "0.2.0"):
        for limit in load_limits(version):
            bound = bounds[limit.experiment, limit.metric, limit.subjects]
            if bound.given:
                continue
            low, high = limit.healthy
            margin = max(resolution(bound, limit.firmware), FURTHEST * (high - low))
            # Limits have three figures, rounded outwards.
            assert math.isinf(limit.at_most) or limit.at_most <= high + margin + 0.011 * abs(high + margin), limit
            assert math.isinf(limit.at_least) or limit.at_least >= low - margin - 0.011 * abs(low - margin), limit


WITHOUT_A_MAP = ("audit", "excursion", "response", "coupling", "holding")
"""Experiments that command codes, so that their readings do not depend on the version that was declared."""


@cache
def healthy_ranges(version):
    return {
        (limit.experiment, limit.metric, limit.subjects[0]): limit
        for limit in load_limits(version)
        if limit.experiment in WITHOUT_A_MAP and limit.healthy and limit.metric != "fist_travel"
    }


@pytest.mark.parametrize(("declared", "real"), list(permutations(FIRMWARE, 2)))
def test_a_board_of_another_version_is_told_by_its_readings(declared, real):
    expected, read = healthy_ranges(declared), healthy_ranges(real)
    telling = [
        key
        for key in expected.keys() & read.keys()
        if read[key].healthy[0] > expected[key].at_most or read[key].healthy[1] < expected[key].at_least
    ]
    # Those with the same windows, motion profile and torque differ in homing, boot text and heat alone.
    one, other = FIRMWARE[declared], FIRMWARE[real]
    alike = (one.settings, one.calibration_states) == (other.settings, other.calibration_states)
    assert bool(telling) == (not alike)


@pytest.mark.parametrize("guarded", [False, True])
@pytest.mark.parametrize("firmware", ["pre", "0.1.5", "0.2.0"])
def test_no_metric_of_a_subject_has_two_limits(firmware, guarded):
    limits = load_limits(firmware, guarded=guarded)
    keys = [(limit.experiment, limit.metric, subject) for limit in limits for subject in limit.subjects]
    assert len(keys) == len(set(keys))


def bounded(**changes):
    return Limit("staircase", "tracking_rms", ("index",), **changes)


def test_a_bound_is_told_as_people_read_it():
    assert bounded(at_most=0.9).text("mm") == "at most 0.9 mm"
    assert bounded(at_least=42.0).text("mm") == "at least 42 mm"
    assert bounded(at_least=42.0, at_most=45.3).text("mm") == "42 to 45.3 mm"


def test_a_reading_at_the_end_of_its_scale_fails_and_says_so():
    metric = EXPERIMENTS["excursion"].metric("closed_percent", "index")
    limit = Limit("excursion", "closed_percent", ("index",), at_most=200.0, given_by="test")
    for value, words in ((100.0, "100 % of the window, at the end of the window"), (99.99, "99.99 % of the window")):
        finding = limit.judge(metric, "index", value)
        assert finding.passed is (value < 100.0)
        assert finding.measured == words
    assert (finding.check, finding.source) == ("closed_percent", "test")
    assert finding.expected == "at most 200 % of the window"


def test_excess_counts_margins_between_healthy_readings_and_limit():
    both = bounded(at_least=-1.0, at_most=6.0, healthy=(0.0, 2.0))
    assert [both.excess(value) for value in (-3.0, -1.0, 0.0, 2.0, 4.0, 10.0)] == [-3.0, -1.0, 0.0, 0.0, 0.5, 2.0]
    above = bounded(at_most=6.0, healthy=(0.0, 2.0))
    assert [above.excess(value) for value in (-2.0, 4.0)] == [0.0, 0.5]
    below = bounded(at_least=-1.0, healthy=(0.0, 2.0))
    assert [below.excess(value) for value in (-2.0, 4.0)] == [-2.0, 0.0]


def test_beyond_a_given_bound_an_excess_is_three():
    given = bounded(at_least=1.0, at_most=2.0)
    assert [given.excess(value) for value in (0.9, 1.0, 2.0, 2.1, math.nan)] == [-3.0, 0.0, 0.0, 3.0, None]


def test_limits_of_guarded_hands_are_for_these_alone():
    free, guarded = (load_limits("0.2.0", guarded=flag) for flag in (False, True))
    assert {limit.guarded for limit in free} == {None, False}
    assert {limit.guarded for limit in guarded} == {None, True}
    assert all(not limit.firmware or "0.2.0" in limit.firmware for limit in (*free, *guarded))
