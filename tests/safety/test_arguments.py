"""Every public call of `aero` copies and checks what it is given, and changes nothing when it refuses it.

The calls are found by their signatures, so that a new one is fed too: a name that `GOOD` does not know fails the test.
"""

import dataclasses
import inspect
import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from aero import ActuationMap, AeroHand, Channel, CommandWindow
from aero.actuation import load_coefficients
from aero.actuation.window import fits_span
from aero.clock import WallClock
from aero.firmware import ServoSettings, firmware_of
from aero.protocol import MAX_CODE, Opcode
from aero.safety import GuardedHand, Thresholds, WatchedClock
from aero.safety.encoders import Encoders, Reading
from aero.safety.regions import Region
from firmware_emulator.bench import Bench
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import InProcessLink

SPANS = np.array(CommandWindow.for_firmware("0.2.0").spans_counts())
EDGES = CommandWindow.for_firmware("0.1.5")
MOVING = {Opcode.CTRL_POS, Opcode.CTRL_TOR, Opcode.HOMING, Opcode.SET_SPE, Opcode.SET_TOR, Opcode.TRIM, Opcode.SET_ID}


class Logged(InProcessLink):
    def __init__(self, electronics):
        super().__init__(electronics)
        self.electronics = electronics
        self.sent = []

    def write(self, data):
        self.sent.append(bytes(data))
        super().write(data)


def new_link():
    electronics = EmulatedHand(Bench(), firmware="0.1.0")  # which does not home when it restarts
    return Logged(electronics), electronics.clock


def guarded(link, clock, **changed):
    how = {"spans_counts": SPANS, "usual": firmware_of("0.1.0").settings} | changed
    return GuardedHand(link, clock, **how)


GOOD = {
    "codes": [0] * 7,
    "magnitudes": [0] * 7,
    "channel": Channel.INDEX,
    "channels": [Channel.INDEX],
    "register_units": 500,
    "degrees": 3,
    "share": 0.5,
    "timeout_s": 10.0,
    "new_id": 3,
    "current_limit": 500,
    "opcode": Opcode.SET_TOR,
}
"""Arguments of the drivers' calls, by name."""
BAD_ARRAYS = st.sampled_from(
    [
        np.full(7, np.nan),
        np.array([0, 0, 0, math.inf, 0, 0, 0]),
        [-1, 0, 0, 0, 0, 0, 0],
        [70000] * 7,
        [0] * 6,
        [[0] * 7],
        7,
        [0.5] * 7,
        ["a"] * 7,
    ]
)
BAD = {
    "codes": BAD_ARRAYS,
    "magnitudes": BAD_ARRAYS,
    "channel": st.sampled_from([9, -1, 7, math.nan, "thumb"]),
    "channels": st.sampled_from([[9], [-1], [Channel.INDEX, math.nan], ["thumb"]]),
    "register_units": st.sampled_from([-1, 40000, math.nan, math.inf, 1.5, True, "1"]),
    "degrees": st.sampled_from([-361, 361, math.nan, math.inf, 1.5]),
    "share": st.sampled_from([-0.1, 1.1, math.nan, math.inf]),
    "timeout_s": st.sampled_from([0.0, -1.0, math.nan, math.inf]),
    "new_id": st.sampled_from([-1, 254, math.nan, 1.5]),
    "current_limit": st.sampled_from([-1, 1024, math.nan, 1.5]),
    "opcode": st.sampled_from([Opcode.HOMING, 7, math.nan, "SET_TOR"]),
}
"""Wrong ones: not a number, not finite, negative, too large, not whole, of another shape."""
WITHOUT = {"open_unguarded", "close", "begin", "check", "resynchronise"}
CALLS = [
    (kind, name, argument)
    for kind in (AeroHand, GuardedHand)
    for name, call in inspect.getmembers(kind, inspect.isfunction)
    if not name.startswith(("_", "read_")) and name not in WITHOUT
    for argument in list(inspect.signature(call).parameters)[1:]
]


@pytest.mark.parametrize(("kind", "name", "argument"), CALLS)
@given(data=st.data())
@settings(max_examples=8, suppress_health_check=list(HealthCheck), deadline=None)
def test_a_wrong_argument_is_refused_before_anything_is_sent(kind, name, argument, data):
    link, clock = new_link()
    hand = AeroHand(link, clock) if kind is AeroHand else guarded(link, clock)
    call = getattr(hand, name)
    arguments = {known: GOOD[known] for known in inspect.signature(call).parameters}
    with pytest.raises((ValueError, TypeError)):
        call(**arguments | {argument: data.draw(BAD[argument])})
    assert not link.sent, "nothing is sent"


@pytest.mark.parametrize("name", ["command_codes", "command_torques"])
def test_a_buffer_that_is_used_again_changes_nothing(name):
    """Neither the slow approach of the first command, nor what is sent again after a restart, reads it."""
    link, clock = new_link()
    buffer = np.array([20000] * 7) if name == "command_codes" else np.array([100] * 7)

    class Refilling(Logged):
        def write(self, data):
            super().write(data)
            buffer[:] = 60000 if name == "command_codes" else 900

    link.__class__ = Refilling
    with guarded(link, clock) as hand:
        getattr(hand, name)(buffer)
        link.electronics.reset()  # the guard sends limits and the last command again
        hand.clock.sleep_until(clock.now() + 2.0)
        sent = {d for d in link.sent if d[:1] in (bytes((Opcode.CTRL_POS,)), bytes((Opcode.CTRL_TOR,)))}
        words = [int.from_bytes(d[at : at + 2], "little") for d in sent for at in range(2, 16, 2)]
        assert max(words) <= (20000 if name == "command_codes" else 100)


NUMBERS = sorted(Thresholds().as_dict())
"""Thresholds that are numbers; the others are regions."""
REGION = Region.of({"index": {"below": 0.6}, "ring": {"below": 0.3}})
BAD_SPANS = [[0] * 7, [-100] * 7, [math.nan] * 7, [math.inf] * 7, [3278] * 6, 3278]


@pytest.mark.parametrize("spans", BAD_SPANS)
def test_a_guard_takes_no_spans_that_no_hand_has(spans):
    link, clock = new_link()
    with pytest.raises(ValueError, match="spans_counts"):
        guarded(link, clock, spans_counts=spans)


@pytest.mark.parametrize("usual", [ServoSettings(-1, 700), ServoSettings(32766, 2000), ServoSettings(math.nan, 700)])
def test_a_guard_takes_no_usual_limits_that_no_board_has(usual):
    link, clock = new_link()
    with pytest.raises(ValueError, match="setting"):
        guarded(link, clock, usual=usual)


@pytest.mark.parametrize("name", NUMBERS)
def test_no_threshold_is_anything_but_a_positive_number(name):
    for wrong in (0, -1, math.nan, math.inf, None, "1", True):
        with pytest.raises(ValueError, match=name):
            Thresholds(**{name: wrong})


@pytest.mark.parametrize("wrong", [0, None, True, "index", REGION, [REGION], (REGION, None), (REGION.as_table(),)])
def test_forbidden_regions_are_a_tuple_of_regions(wrong):
    """A list could be changed under the guard; a table would fail at the first command."""
    with pytest.raises(ValueError, match="forbidden: expected a tuple of regions"):
        Thresholds(forbidden=wrong)


@pytest.mark.parametrize("name", ["gentle_speed", "gentle_torque", "stop_torque", "limp_torque"])
def test_a_setting_is_a_whole_number_that_the_board_stores(name):
    for wrong in (1.5, 40000):
        with pytest.raises(ValueError, match=name):
            Thresholds(**{name: wrong})


@pytest.mark.parametrize("name", NUMBERS)
def test_every_threshold_has_a_physical_bound(name):
    """`current_a = 3500` was taken, and the guard would have stopped at 3500 A."""
    with pytest.raises(ValueError, match=rf"{name}: expected at most"):
        Thresholds(**{name: 10**6})
    usual = getattr(Thresholds(), name)
    assert getattr(Thresholds(**{name: usual}), name) == usual


@pytest.mark.parametrize(("name", "value", "unit"), [("current_a", 3500, "mA"), ("current_s", 300, "ms")])
def test_a_threshold_in_another_unit_is_asked_about(name, value, unit):
    with pytest.raises(ValueError, match=rf"{value}; {unit}\?"):
        Thresholds(**{name: value})


def test_encoders_keep_no_array_of_their_caller():
    spans, at, command = SPANS.astype(float), np.zeros(7), np.full(7, 0.5)
    encoders = Encoders(Thresholds(), spans, 0.0)
    encoders.found(0.0, at)
    encoders.commanded(0.1, command)
    spans[:], at[:], command[:] = 1e9, 1.0, 0.0
    reached = [list(encoders.violations(Reading(t, t, np.full(7, 0.5)))) for t in np.arange(3.0, 4.0, 0.04)]
    assert not any(reached)


@pytest.mark.parametrize("t", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("clock", [WallClock(), WatchedClock(WallClock(), lambda: None, 0.04)])
def test_no_clock_waits_for_a_moment_that_never_comes(clock, t):
    with pytest.raises(ValueError, match="time in s"):
        clock.sleep_until(t)


CODEC = ActuationMap.for_firmware("0.2.0")
CONVERSIONS = {
    "angles_from_codes": (CODEC.angles_from_codes, 7),
    "codes_from_angles": (CODEC.codes_from_angles, 7),
    "codes_from_lengths": (CODEC.codes_from_lengths, 7),
    "codes_from_joints": (CODEC.codes_from_joints, 16),
    "codes_from_compact": (CODEC.codes_from_compact, 7),
    "saturating_codes": (CODEC.saturating_codes, 7),
    "fits_span": (lambda codes: fits_span(codes, 1025), 7),
}
"""What ends in codes or begins with them, with its width."""


@pytest.mark.parametrize("name", CONVERSIONS)
@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
def test_no_code_is_made_of_what_is_no_number(name, wrong):
    call, width = CONVERSIONS[name]
    values = np.zeros(width)
    values[3] = wrong
    with pytest.raises(ValueError, match=r"finite|expected|outside"):
        call(values)


@pytest.mark.parametrize("name", [name for name in CONVERSIONS if name != "fits_span"])
@pytest.mark.parametrize("wrong", [np.zeros((3, 5), int), np.int64(3)])
def test_no_code_is_made_of_another_shape(name, wrong):
    with pytest.raises(ValueError, match="shape"):
        CONVERSIONS[name][0](wrong)


def test_what_a_map_is_made_of_cannot_be_changed_from_outside():
    extend, grasp = list(EDGES.extend_counts), np.array(EDGES.grasp_counts)
    window = CommandWindow("mine", "right", extend, grasp)
    extend[0], grasp[0] = 5, 3000
    assert (window.extend_counts, window.grasp_counts) == (EDGES.extend_counts, EDGES.grasp_counts)
    paper = load_coefficients("paper")
    radii = list(paper.finger_winding)
    mine = dataclasses.replace(paper, finger_winding=radii)
    radii[0] = 1.0
    assert mine == paper


@pytest.mark.parametrize("array", [CODEC.winding_matrix, CODEC.excursion_rad, CODEC.window_rad])
def test_constants_cannot_be_written(array):
    with pytest.raises(ValueError, match="read-only"):
        array[0] = MAX_CODE


@pytest.mark.parametrize("counts", [[0.5] * 7, [math.nan] * 7, [-1] * 7, [5000] * 7, [0] * 6])
def test_a_window_is_made_of_counts(counts):
    with pytest.raises(ValueError, match="extend_counts"):
        CommandWindow("mine", "right", counts, EDGES.grasp_counts)
