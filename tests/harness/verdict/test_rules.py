"""Each rule by its name: the failed checks that it is about, and what it leaves."""

import pytest

from aero.channels import Channel
from aero.errors import LinkTimeoutError
from aero.protocol import Opcode
from aero.safety import SafetyReason, SafetyStopError
from hil.checks import JUDGED
from hil.verdict.diagnosis import Component, rows
from hil.verdict.rules import Failures, rule_for
from hil.verdict.run_end import FINISHED, EndKind, RunEnd

FINGERS = ("index", "middle", "ring", "pinky")


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
    return found


def told(end=FINISHED, sides=None, **checks):
    found = failures(**checks)
    location, row = rule_for(Failures(found, sides or {}), end)
    return location.component, location.channels, row


def all_of(excess, labels=FINGERS):
    return dict.fromkeys(labels, excess)


RING = (Channel.RING,)
HAND_RULES = {
    "driver": ({"driver__sent": 3, "staircase__tracking_rms": 9}, Component.DRIVER, "driver"),
    "restart": ({"session__restarts": 3, "session__lost_replies": 3}, Component.BOARD, "restarts"),
    "older firmware": ({"session__unanswered_limits": 3}, Component.BOARD, "older_firmware"),
    "bytes lost": ({"session__lost_replies": 3, "replay__replay_shape": all_of(4)}, Component.LINK, "bytes"),
    "bytes too many": ({"session__stray_bytes": 3}, Component.LINK, "bytes"),
    "replies misread on a bad link": (
        {"session__stray_bytes": 3, "driver__read_currents": all_of(3)},
        Component.LINK,
        "bytes",
    ),
    "commands falsified on a bad link": ({"session__lost_replies": 3, "driver__sent": 3}, Component.DRIVER, "driver"),
    "all readings jump": ({"staircase__overshoot_hand_percent": all_of(9)}, Component.LINK, "bytes"),
    "lower bytes lost": ({"staircase__lower_byte": 5}, Component.LINK, "bytes"),
    "bus stands still": ({"presence__distinct_readings": -3}, Component.LINK, "bus"),
    "late replies": ({"presence__round_trip": 3, "replay__replay_delay": all_of(2)}, Component.LINK, "late_link"),
    "late telemetry": (
        {"response__telemetry_period": 3, "replay__replay_shape": all_of(2)},
        Component.LINK,
        "late_link",
    ),
    "repeats": ({"excursion__stale_readings": 3, "replay__replay_shape": all_of(5)}, Component.LINK, "repeats"),
    "weak supply": ({"excursion__closed_percent": all_of(-4)}, Component.SUPPLY, "supply"),
    "supply too weak for fingers and thumb": (
        {
            "excursion__closed_percent": {"middle": -81, "ring": -24},
            "staircase__excursion_hand": {"thumb_cmc_flexion": -9},
            "staircase__late_steps": all_of(5, FINGERS[:3]),
        },
        Component.SUPPLY,
        "supply",
    ),
    "supply too weak to hold": (
        {"holding__creep_percent": all_of(9), "excursion__closed_percent": all_of(-500)},
        Component.SUPPLY,
        "supply",
    ),
    "supply too weak for the thumb": (
        {
            "audit__pull": {"thumb_cmc_flexion": 12, "thumb_flexor": 6},
            "audit__followed": {"thumb_cmc_flexion": -2.5, "thumb_flexor": -1.3},
        },
        Component.SUPPLY,
        "supply",
    ),
    "commands lost": ({"staircase__late_steps": all_of(5)}, Component.LINK, "bytes"),
    "late servos": (
        {"response__command_to_motion": 3, "replay__replay_delay": all_of(2)},
        Component.HAND,
        "late_servos",
    ),
    "other side": ({"audit__followed": all_of(2, FINGERS[:3])}, Component.BOARD, "other_side"),
}
CHANNEL_RULES = {
    "joint stops early": (
        {"staircase__take_up": 7.1, "staircase__spring_shape": 1.8, "staircase__load_jump": 9.1},
        "slack",
    ),
    "joint stops early, and little pulls": (
        {"audit__pull": -1.5, "staircase__take_up": 21.7, "staircase__spring_shape": 3.7},
        "slack",
    ),
    "no power": ({"audit__followed": -50, "audit__pull": -4, "excursion__closed_percent": -99}, "no_power"),
    "blocked": ({"audit__followed": -50, "presence__idle_current": 30}, "blocked"),
    "coarse": ({"staircase__resolution": 3, "staircase__overshoot_hand_percent": 9}, "coarse"),
    "jumping": ({"staircase__overshoot_hand_percent": 9, "holding__creep_percent": 9}, "jumping"),
    "cuts out": ({"holding__creep_percent": 99, "staircase__tracking_rms": 9}, "cuts_out"),
    "drift": ({"holding__creep_percent": 1.2, "alike__held_again": 5}, "drift"),
    "current that fades": ({"alike__held_again": -3}, "drift"),
    "cable off": ({"audit__pull": -2, "excursion__closed_percent": 2, "staircase__take_up": 99}, "cable_off"),
    "cable off before it closes": ({"audit__pull": -4, "audit__followed": 1.1}, "cable_off"),
    "nothing pulls": ({"staircase__spring": -2, "staircase__take_up": 99}, "cable_off"),
    "current sensor": (
        {"staircase__spring": -2, "excursion__stop_current": -3, "staircase__take_up": 99},
        "current_sensor",
    ),
    "zero": ({"presence__idle_current": 3}, "zero"),
    "weak spring": ({"holding__holding_current": -2}, "spring_weak"),
    "slow": ({"excursion__closed_percent": -9, "alike__rise": 4}, "slow"),
    "dry friction": ({"staircase__dry_friction": 5}, "friction"),
    "more load than friction": ({"staircase__spring": 3.1, "staircase__friction": 1.4}, "joint"),
    "more friction than load": ({"staircase__spring": 1.4, "staircase__friction": 3.8}, "friction"),
    "slack": ({"staircase__take_up": 7}, "slack"),
    "strong spring": ({"excursion__closed_percent": -9, "holding__holding_current": 3}, "spring_strong"),
    "weak": ({"excursion__closed_percent": -9}, "weak"),
    "fast": ({"alike__opening": -3}, "fast"),
    "one joint": ({"staircase__spring_shape": -4}, "joint"),
    "loaded": ({"staircase__spring": 2}, "joint"),
    "current that reads too much": ({"staircase__spring": 2, "excursion__stop_current": 2}, "current_sensor"),
    "hot": ({"presence__temperature": 3}, "hot"),
    "cold": ({"alike__temperature": -7}, "temperature_sensor"),
    "answers": ({"response__standstill": 9}, "answers"),
}


@pytest.mark.parametrize(("checks", "component", "row"), HAND_RULES.values(), ids=HAND_RULES)
def test_a_rule_of_the_hand(checks, component, row):
    assert told(**checks) == (component, (), row)


@pytest.mark.parametrize(("checks", "row"), CHANNEL_RULES.values(), ids=CHANNEL_RULES)
def test_a_rule_of_a_channel(checks, row):
    assert told(**checks) == (Component.CHANNEL, RING, row)


def test_two_channels_that_move_each_other_are_exchanged():
    moved = {"index": 9, "middle": 9}
    found = told(audit__others_moved=moved, audit__followed=all_of(-50, FINGERS[:2]))
    assert found == (Component.CHANNELS, (Channel.INDEX, Channel.MIDDLE), "exchanged")


def test_two_fingers_whose_loads_grow_to_opposite_sides_are_exchanged():
    """As found on the cables of middle and ring exchanged: nothing else tells it on the wire."""
    shapes = {"middle": -3.9, "ring": 3.4}
    found = told(staircase__spring_shape=shapes)
    assert found == (Component.CHANNELS, (Channel.MIDDLE, Channel.RING), "exchanged")
    assert told(staircase__spring_shape=shapes, staircase__friction=2.0)[:2] == (Component.CHANNEL, RING)


def test_a_board_that_restarts_is_no_driver_that_misreads():
    assert told(session__restarts=3.0, driver__read_currents=all_of(3))[::2] == (Component.BOARD, "restarts")


def test_limits_that_are_acknowledged_late_are_no_older_firmware():
    late = told(session__unanswered_limits=3.0, presence__round_trip=3.0)
    assert late == (Component.LINK, (), "late_link")


def test_a_channel_that_follows_by_nine_tenths_rubs_and_is_not_stuck():
    """As found on friction of the gear at 0.13 N m, which fails the gate."""
    assert told(audit__followed=-4.4, audit__pull=4.8)[2] == "friction"


@pytest.mark.parametrize("check", ["staircase__rise_hand_ms", "excursion__closed_percent", "audit__followed"])
def test_readings_that_could_not_be_measured_accuse_nothing(check):
    assert told(**{check: all_of(None)}) == (Component.UNKNOWN, (), "")


def test_thumb_cables_are_exchanged_where_nothing_stops_the_base():
    closed = {"thumb_cmc_flexion": 40, "thumb_flexor": -30}
    assert told(excursion__closed_percent=closed)[2] == "exchanged"


def test_a_little_on_all_to_one_side_is_the_supply():
    sides = {("excursion", "closed_percent", label): -0.9 for label in FINGERS}
    assert told(sides=sides, excursion__fist_travel=-1.1)[::2] == (Component.SUPPLY, "supply")


SLOWER_THAN_ANY = {("response", "open_close_rate", "hand"): -1.4}


def test_a_hand_slower_than_any_healthy_one_whose_fingers_are_alike_has_too_little_torque():
    """As found on hands with `supply_low` of 0.24 and 0.32: a little on a few channels of several digits."""
    checks = {"excursion__fist_travel": -2.3, "holding__holding_current": {"thumb_flexor": 1.9}}
    assert told(sides=SLOWER_THAN_ANY, **checks)[::2] == (Component.SUPPLY, "supply")
    assert told(**checks)[:2] == (Component.CHANNEL, RING)


def test_a_reading_of_the_hand_goes_to_the_finger_that_alone_shows_it():
    """As found on play of 96 counts behind one encoder: 29 ms of standstill, 9 ms on the other fingers."""
    still = {("response", "standstill", label): -0.6 for label in FINGERS} | {("response", "standstill", "ring"): 2.4}
    assert told(sides=still, response__longest_standstill=1.2) == (Component.CHANNEL, RING, "answers")
    assert told(response__longest_standstill=1.2) == (Component.UNKNOWN, (), "")


def test_a_finger_that_jumps_leaves_no_late_servos():
    jumps = {"response__command_to_motion": 3.0, "staircase__overshoot_hand_percent": 9.0}
    assert told(**jumps) == (Component.CHANNEL, RING, "jumping")


def test_a_slow_hand_with_one_finger_behind_the_others_or_with_more_load_is_that_fingers():
    weak = {"excursion__closed_percent": -9, "holding__holding_current": 2.6}
    behind = SLOWER_THAN_ANY | {("alike", "rise", "ring"): 1.1}
    assert told(sides=behind, **weak)[:2] == (Component.CHANNEL, RING)
    assert told(sides=SLOWER_THAN_ANY, staircase__spring=2.0, audit__pull=2.0)[:2] == (Component.CHANNEL, RING)
    assert told(sides=SLOWER_THAN_ANY, staircase__dry_friction=2.0)[:2] == (Component.CHANNEL, RING)


def test_the_thumb_alone_is_no_whole_hand():
    """As found on a dead motor of thumb abduction: the other two go further, and farther off."""
    found = told(
        audit__followed={"thumb_abduction": -31},
        excursion__closed_percent={"thumb_abduction": -100, "thumb_cmc_flexion": 79, "thumb_flexor": 3.5},
        staircase__tracking_rms={"thumb_abduction": 275, "thumb_cmc_flexion": 31, "thumb_flexor": 16},
        staircase__spring={"thumb_cmc_flexion": -5.4},
    )
    assert found == (Component.CHANNEL, (Channel.THUMB_ABDUCTION,), "no_power")


def test_a_current_at_rest_in_the_base_of_the_thumb_may_come_from_either_channel():
    base = (Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION)
    for one in base:
        assert told(presence__idle_current={one.label: 3.0}) == (Component.CHANNELS, base, "zero")
    further = {"thumb_cmc_flexion": 1.9}
    assert told(excursion__closed_percent=further) == (Component.CHANNELS, base, "stop_moved")


def test_the_channel_for_which_most_speaks():
    found = told(staircase__friction={"index": 1.1, "ring": 3.0}, staircase__dry_friction=4.0)
    assert found == (Component.CHANNEL, RING, "friction")


def test_what_no_rule_explains_is_said():
    assert told(holding__warming=2.0) == (Component.CHANNEL, RING, "")
    assert told(response__telemetry_period=-3.0) == (Component.UNKNOWN, (), "")


STOPS = {
    SafetyReason.CURRENT: "blocked",
    SafetyReason.TEMPERATURE: "hot",
    SafetyReason.JUMP: "jumping",
    SafetyReason.STRAY: "stray",
}


@pytest.mark.parametrize("reason", STOPS, ids=lambda reason: reason.value)
def test_a_stop_of_the_guard_is_judged_by_its_reason_and_channel(reason):
    """Its words name another channel, and are not read."""
    end = RunEnd(EndKind.STOPPED, "excursion", "the pinky", SafetyStopError("the pinky", reason, Channel.RING))
    assert told(end) == (Component.CHANNEL, RING, STOPS[reason])


def test_a_hand_that_nobody_watched_is_this_computers():
    end = RunEnd(EndKind.STOPPED, "excursion", "", SafetyStopError("", SafetyReason.UNWATCHED))
    assert told(end)[::2] == (Component.HOST, "held_up")


def test_a_stop_beside_a_check_that_says_more():
    end = RunEnd(EndKind.STOPPED, "response", "", SafetyStopError("", SafetyReason.STRAY, Channel.RING))
    assert told(end, audit__followed=-50, audit__pull=-4)[2] == "no_power"


def test_ends_without_a_channel():
    silent = RunEnd(EndKind.LINK, "audit", "no reply", LinkTimeoutError("no reply"))
    assert told(silent, session__lost_replies=3)[::2] == (Component.BOARD_OR_LINK, "silent")
    gone = RunEnd(EndKind.LINK, "audit", "gone", ConnectionError("gone"))
    assert told(gone)[::2] == (Component.LINK, "port_gone")
    pre = SafetyStopError("", SafetyReason.SILENT, unanswered=Opcode.SET_SPE)
    assert told(RunEnd(EndKind.STOPPED, "audit", "", pre))[::2] == (Component.BOARD, "older_firmware")


def test_every_row_that_a_rule_names_is_there():
    named = {row for *_, row in (*HAND_RULES.values(), *CHANNEL_RULES.values())} | set(STOPS.values())
    assert named <= rows().keys()
