"""Each rule by its name: what fails, and which suspects lead."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import FINGERS, Channel
from aero.errors import LinkTimeoutError
from aero.safety import SafetyReason, SafetyStopError
from hil.checks import JUDGED
from hil.verdict.diagnosis import Diagnosis
from hil.verdict.failures import Failures
from hil.verdict.judge import Judge
from hil.verdict.limits import load_limits
from hil.verdict.parts import Part, Suspect
from hil.verdict.run_end import FINISHED, EndKind, RunEnd
from hil.verdict.suspects import (
    CURRENTS,
    FALSIFIED,
    OF_OLD_TELEMETRY,
    SENSORS,
    TORQUE,
    RunSigns,
    clues,
    suspected,
)

ALL = tuple(finger.label for finger in FINGERS)


def failures(**checks):
    """Failures by `experiment__metric=excess` of the ring, `={subject: excess}`, or of a check of the hand."""
    found = {}
    for name, excess in checks.items():
        experiment, metric = name.split("__")
        subjects = {
            subject for known in JUDGED[experiment].metrics if known.name == metric for subject in known.subjects
        }
        on = excess if isinstance(excess, dict) else {"hand" if subjects == {"hand"} else "ring": excess}
        found |= {(experiment, metric, subject): value for subject, value in on.items()}
    return Failures(found)


def suspects(end=FINISHED, **checks):
    signs = RunSigns(failures(**checks), end)
    return suspected(signs, clues(signs))


def leading(end=FINISHED, **checks):
    return Diagnosis(suspects(end, **checks)).leading


def all_of(excess, labels=ALL):
    return dict.fromkeys(labels, excess)


STOPPED = RunEnd(EndKind.STOPPED, error=SafetyStopError("", SafetyReason.STALE))
SILENT = RunEnd(EndKind.LINK, error=LinkTimeoutError("", 0, 0.0))
GONE = RunEnd(EndKind.LINK, error=ConnectionError())
OF_THE_WHOLE = {
    "driver": ({"driver__sent": 3, "staircase__tracking_rms": 9}, FINISHED, Part.DRIVER),
    "restart": ({"session__restarts": 3, "session__lost_replies": 3}, FINISHED, Part.BOARD),
    "bytes": ({"session__lost_replies": 3, "replay__replay_shape": all_of(4)}, FINISHED, Part.USB),
    "replies misread on a bad link": (
        {"session__stray_bytes": 3, "driver__read_currents": all_of(3)}, FINISHED, Part.USB,
    ),
    "port gone": ({}, GONE, Part.USB),
    "silent": ({}, SILENT, Part.BOARD),
    "stands still": ({"presence__distinct_readings": -3}, STOPPED, Part.BUS),
    "late": ({"presence__round_trip": 3, "replay__replay_delay": all_of(2)}, FINISHED, Part.USB),
    "torque of all": ({"excursion__closed_percent": all_of(-3), "staircase__spring": all_of(2)}, FINISHED, Part.SUPPLY),
    "unanswered limits": ({"session__unanswered_limits": 3}, FINISHED, Part.SETUP),
    "all alike": ({"staircase__take_up": all_of(3)}, FINISHED, Part.SETUP),
}  # fmt: skip


@pytest.mark.parametrize("name", OF_THE_WHOLE)
def test_what_the_whole_hand_shares_leads_to_no_channel(name):
    checks, end, part = OF_THE_WHOLE[name]
    first = leading(end, **checks)
    assert Suspect(part) in first
    assert all(suspect.channel is None for suspect in first)


def test_one_channel_leaves_its_servo_and_its_digit():
    assert set(leading(staircase__friction=4)) == {Suspect(part, Channel.RING) for part in (Part.SERVO, Part.DIGIT)}


def test_a_channel_that_stops_early_and_pulls_at_nothing_leads_to_its_servo():
    """An angle limit was left in its registers; what is held pulls."""
    assert leading(excursion__fist_travel=-90, staircase__tracking_rms=9)[0] == Suspect(Part.SERVO, Channel.RING)
    held = leading(excursion__fist_travel=-90, staircase__tracking_rms=9, staircase__spring_shape=40)
    assert Suspect(Part.DIGIT, Channel.RING) in held


def test_abduction_is_suspected_where_cmc_flexion_goes_further_than_it_lets_it():
    off = {"thumb_abduction": -1.2, "thumb_cmc_flexion": -13.8}
    first = leading(excursion__stop_current=off, excursion__closed_percent={"thumb_cmc_flexion": 15.0})
    assert {suspect.channel for suspect in first} == {Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION}


def test_a_reading_that_a_servo_makes_by_itself_leads_to_it():
    assert leading(staircase__resolution=4) == (Suspect(Part.SERVO, Channel.RING),)


def test_a_hand_reading_a_little_off_does_not_win_over_fifty_of_a_channel():
    """A bottle in the hand: one reading of the hand of 0.503 where 0.5 is the most made a USB cable of it."""
    first = leading(
        response__command_to_motion=1.01, excursion__closed_percent=-30, staircase__spring=9, audit__followed=-9
    )
    assert all(suspect.channel is Channel.RING for suspect in first)


EXCHANGED = {"ring": -90, "middle": -90}


@pytest.mark.parametrize("moved", [{}, {"audit__others_moved": {"ring": 9, "middle": 9}}])
def test_two_channels_that_fail_together_share_a_cause(moved):
    first = leading(audit__followed=EXCHANGED, **moved)
    assert {Suspect(Part.DIGIT, Channel.MIDDLE), Suspect(Part.BOARD)} <= set(first)


def test_currents_alone_of_several_channels_lead_to_the_board():
    """Half the current scale was told as two weak motors."""
    low = {"thumb_flexor": -7.5, "thumb_cmc_flexion": -7.4}
    assert leading(excursion__stop_current=low) == (Suspect(Part.BOARD),)
    assert Suspect(Part.BOARD) not in leading(excursion__stop_current=low, audit__followed={"thumb_flexor": -9.0})


def test_old_readings_that_come_in_time_lead_to_a_loop_of_the_board_too():
    assert Suspect(Part.BOARD) in leading(response__telemetry_period=10.9)
    assert Suspect(Part.BOARD) not in leading(presence__round_trip=3, response__telemetry_period=10.9)


def test_a_current_that_flows_the_other_way_leads_to_a_sign_of_the_board_too():
    assert Suspect(Part.BOARD) in leading(audit__pull=-14.1, staircase__friction=-16.5)
    assert Suspect(Part.BOARD) not in leading(audit__pull=-3.1, staircase__friction=-7.2)


KEYS = sorted(
    (judged.name, metric.name, subject)
    for judged in JUDGED.values()
    for metric in judged.metrics
    if metric.checks
    for subject in metric.subjects
)


@given(st.dictionaries(st.sampled_from(KEYS), st.floats(1.1, 90.0) | st.floats(-90.0, -1.1), max_size=12))
def test_suspects_sum_to_one_and_every_failure_is_some_rules(off):
    signs = RunSigns(Failures(off), FINISHED)
    found = clues(signs)
    likely = suspected(signs, found)
    assert not likely or math.isclose(sum(likely.values()), 1.0)
    assert all(clue.accounts_for <= off.keys() for clue in found)


def test_what_is_not_measurable_accuses_nobody():
    measured = {"presence": {"hand": {"round_trip": math.nan}}, "staircase": {"ring": {"spring": math.nan}}}
    failed = Failures.of(measured, load_limits("0.2.0"))
    assert not failed.off
    assert Judge("0.2.0", guarded=False).signs(measured, FINISHED).failures == failed


def test_every_check_that_a_rule_names_is_judged():
    """A metric that is renamed or dropped is noticed here."""
    judged = {f"{experiment}/{metric}" for experiment, metric, _ in KEYS}
    assert {*CURRENTS, *FALSIFIED, *OF_OLD_TELEMETRY, *TORQUE, *SENSORS} <= judged
