"""From the evidence of a run to its suspects."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import FINGERS, Channel
from aero.errors import LinkTimeoutError, NoTelemetryError
from aero.safety import SafetyReason, SafetyStopError
from hil.checks import JUDGED
from hil.checks.shared.declaration import EvidenceKind
from hil.verdict.failures import EVIDENCE, Failures
from hil.verdict.judge import Judge
from hil.verdict.limits import load_limits
from hil.verdict.part import Part
from hil.verdict.parts import Suspect
from hil.verdict.run_end import FINISHED, EndKind, RunEnd
from hil.verdict.suspects import CAN, THUMB, RunSigns, isolate

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


def isolated(end=FINISHED, **checks):
    return isolate(RunSigns(failures(**checks).by_fault, end))


def of(channel, *parts):
    return {Suspect(part, channel) for part in parts}


def all_of(excess, labels=ALL):
    return dict.fromkeys(labels, excess)


STOPPED = RunEnd(EndKind.STOPPED, error=SafetyStopError("", SafetyReason.STALE))
SILENT = RunEnd(EndKind.LINK, error=LinkTimeoutError("", 0, 0.0))
GONE = RunEnd(EndKind.LINK, error=ConnectionError())
UNREAD = RunEnd(EndKind.LINK, error=NoTelemetryError())
OF_THE_WHOLE = {
    "driver": ({"driver__sent": 3, "staircase__tracking_rms": 9}, FINISHED, Part.DRIVER),
    "restart": ({"session__restarts": 3, "session__lost_replies": 3}, FINISHED, Part.BOARD),
    "bytes": ({"session__lost_replies": 3, "replay__replay_shape": all_of(4)}, FINISHED, Part.USB),
    "replies misread on a bad link": (
        {"session__stray_bytes": 3, "driver__read_wrong": all_of(3)}, FINISHED, Part.USB,
    ),
    "port gone": ({}, GONE, Part.USB),
    "silent": ({}, SILENT, Part.BOARD),
    "servos never read": ({}, UNREAD, Part.BUS),
    "stands still": ({"presence__distinct_readings": -3}, STOPPED, Part.BUS),
    "late": ({"presence__round_trip": 3, "replay__replay_delay": all_of(2)}, FINISHED, Part.USB),
    "torque of all": ({"excursion__closed_percent": all_of(-3), "staircase__spring": all_of(2)}, FINISHED, Part.SUPPLY),
    "unanswered limits": ({"session__unanswered_limits": 3}, FINISHED, Part.SETUP),
    "all alike": ({"staircase__take_up": all_of(3)}, FINISHED, Part.SETUP),
}  # fmt: skip


@pytest.mark.parametrize("name", OF_THE_WHOLE)
def test_what_the_whole_hand_shares_leads_to_no_channel(name):
    checks, end, part = OF_THE_WHOLE[name]
    found = isolated(end, **checks)
    assert Suspect(part) in found.strong
    assert all(suspect.channel is None for suspect in found.strong)


def test_one_channel_leaves_its_servo_its_digit_and_the_set_up():
    found = isolated(staircase__friction=4)
    assert found.strong == of(Channel.RING, Part.SERVO, Part.DIGIT) | {Suspect(Part.SETUP)}


def test_the_supply_is_suspected_with_a_digit_where_the_hand_is_slow_too():
    found = isolated(excursion__closed_percent=-9, response__open_close_rate=-2)
    assert found.strong == of(Channel.RING, Part.SERVO, Part.DIGIT) | {Suspect(Part.SETUP), Suspect(Part.SUPPLY)}


def test_abduction_is_suspected_where_cmc_flexion_goes_further_than_it_lets_it():
    found = isolated(excursion__closed_percent={"thumb_cmc_flexion": 15.0})
    servos = {one.channel for one in found.strong if one.part is Part.SERVO}
    assert servos == {Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION}
    assert {one.channel for one in found.strong if one.part is Part.DIGIT} == THUMB


def test_a_reading_that_a_servo_makes_by_itself_leads_to_it():
    assert isolated(staircase__resolution=4).strong == of(Channel.RING, Part.SERVO)


def test_what_is_off_in_fast_motion_alone_is_hardly_mechanical():
    found = isolated(replay__replay_delay=13, replay__replay_shape=2)
    assert found.strong == of(Channel.RING, Part.SERVO) | {Suspect(Part.BUS), Suspect(Part.BOARD)}


def test_a_hand_reading_that_is_off_too_does_not_win_over_a_channel():
    """A bottle in the hand: one reading of the hand of 0.503 where 0.5 is the most made a USB cable of it."""
    found = isolated(response__command_to_motion=1.01, excursion__closed_percent=-30, staircase__spring=9)
    assert {Suspect(Part.DIGIT, Channel.RING), Suspect(Part.SETUP)} <= found.strong
    assert Suspect(Part.USB) not in found.strong


def test_the_channel_with_more_kinds_of_evidence_is_suspected():
    found = isolated(audit__followed={"ring": -9, "index": -2}, staircase__spring=2)
    assert {one.channel for one in found.strong} == {Channel.RING, None}
    assert Suspect(Part.SERVO, Channel.INDEX) in found.weak


def test_servos_that_are_warm_beside_a_digit_that_does_not_move_are_not_suspected():
    """A dead motor stays cold; beside it six good servos were too warm, and all that digits share was suspected."""
    warm = {"index": 2.2, "middle": 2.2, "ring": -1.2, "pinky": 2.2, "thumb_abduction": -1.2}
    found = isolated(audit__followed=-92, alike__temperature=warm)
    assert found.strong == of(Channel.RING, Part.SERVO, Part.DIGIT) | {Suspect(Part.SETUP)}
    assert all(one.channel is None for one in isolated(alike__temperature=warm).strong)


def test_two_fingers_alike_share_a_supply_a_set_up_or_an_exchange():
    """A supply too weak for a fist stopped two fingers, and 19 minutes of steps ended with a digit and a servo."""
    found = isolated(excursion__closed_percent={"ring": -9, "middle": -9}, excursion__fist_travel={"ring": -3})
    shared = set(map(Suspect, (Part.SUPPLY, Part.SETUP, Part.BOARD)))
    assert shared | of(Channel.RING, Part.DIGIT) | of(Channel.MIDDLE, Part.DIGIT) <= found.strong


def test_an_encoder_that_moves_with_another_command_leads_to_both_servos():
    found = isolated(audit__followed=-90, audit__others_moved={"pinky": 32})
    assert of(Channel.RING, Part.SERVO) | of(Channel.PINKY, Part.SERVO) | {Suspect(Part.BOARD)} <= found.strong


@pytest.mark.parametrize(
    ("reason", "strong"),
    [
        (SafetyReason.STRAY, of(Channel.INDEX, Part.SERVO, Part.DIGIT) | {Suspect(Part.SETUP)}),
        (SafetyReason.TEMPERATURE, of(Channel.INDEX, Part.SERVO)),
        (SafetyReason.CURRENT, of(Channel.INDEX, Part.SERVO, Part.DIGIT) | {Suspect(Part.SETUP)}),
    ],
)
def test_a_guard_stop_is_evidence_of_the_channel_that_it_names(reason, strong):
    end = RunEnd(EndKind.STOPPED, error=SafetyStopError("", reason, Channel.INDEX))
    assert isolate(RunSigns(Failures.of({}, (), end), end)).strong == strong


def test_a_servo_that_the_boot_text_names_is_suspected_on_its_channel():
    found = isolate(RunSigns(failures(presence__distinct_readings=-3), FINISHED, silent=(Channel.RING,)))
    assert found.strong == of(Channel.RING, Part.SERVO) | {Suspect(Part.BUS)}


def test_a_lossy_link_explains_late_motion_and_no_missing_torque():
    """One lost acknowledgement hid a weak motor for good: only the layer of the link spoke."""
    found = isolated(session__lost_replies=3, replay__replay_shape=all_of(4), staircase__spring=-4, audit__pull=-3)
    link, ring = found.clues
    assert {piece.kind for piece in link.explains} == {EvidenceKind.BYTES, EvidenceKind.TIME}
    assert all(piece.subject == "ring" for piece in ring.explains)
    assert of(Channel.RING, Part.SERVO, Part.DIGIT) <= ring.strong
    alone = isolated(staircase__spring=-4, audit__pull=-3)
    assert alone.clues[0].strong == ring.strong


def test_two_digits_with_several_kinds_of_evidence_have_a_clue_each():
    found = isolated(
        audit__followed={"ring": -9, "index": -9}, staircase__spring={"ring": 2, "index": 2}, replay__replay_delay=9
    )
    assert [{piece.subject for piece in clue.explains} for clue in found.clues] == [{"ring"}, {"index"}]


@pytest.mark.parametrize("part", Part)
def test_every_part_can_cause_something_and_every_kind_but_an_answer_has_a_part(part):
    assert CAN[part]
    assert frozenset().union(*CAN.values()) == frozenset(EvidenceKind) - {EvidenceKind.SEEN}


KEYS = sorted(
    (judged.name, metric.name, subject)
    for judged in JUDGED.values()
    for metric in judged.metrics
    if metric.bounds
    for subject in metric.subjects
)


EXCESS = st.floats(1.1, 90.0) | st.floats(-90.0, -1.1)
OFF = st.dictionaries(st.sampled_from(KEYS), EXCESS, min_size=1, max_size=12)


@given(OFF)
def test_every_failure_leaves_suspects_and_none_is_strong_and_weak(off):
    found = isolate(RunSigns(Failures(off), FINISHED))
    judged = {kind for key in off if (kind := EVIDENCE[key[:2]]) is not EvidenceKind.SEEN}
    assert found.strong or not judged
    assert all(clue.strong.isdisjoint(clue.weak) for clue in found.clues)
    pieces = [piece for clue in found.clues for piece in clue.explains]
    assert len({*pieces}) == len(pieces)


@given(OFF, st.data())
def test_one_metric_more_of_the_same_cause_leaves_the_same_suspects(off, data):
    """A hot servo was 0.85 of all suspicion, and 0.68 with one more metric of its heat."""
    key = data.draw(st.sampled_from(sorted(off)))
    alike = [one for one in KEYS if EVIDENCE[one[:2]] is EVIDENCE[key[:2]] and one[2] == key[2] and one not in off]
    if not alike:
        return
    more = {data.draw(st.sampled_from(alike)): off[key]}
    assert isolate(RunSigns(Failures(off | more), FINISHED)) == isolate(RunSigns(Failures(off), FINISHED))


def test_what_is_not_measurable_accuses_nobody():
    measured = {"presence": {"hand": {"round_trip": math.nan}}, "staircase": {"ring": {"spring": math.nan}}}
    failed = Failures.of(measured, load_limits("0.2.0"))
    assert not failed.off
    assert Judge("0.2.0", guarded=False).signs(measured, FINISHED).failures == failed
