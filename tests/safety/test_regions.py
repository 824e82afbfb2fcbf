"""Forbidden regions: commands stop at their edge, openings and policies go round them, and the guard sees no stop."""

import numpy as np
import pytest
from guarded_hands import guarded, wait
from hypothesis import given, settings
from hypothesis import strategies as st

from aero.channels import Channel
from aero.policy.running import Ending, RunSettings
from aero.policy.shipped import find_policy
from aero.protocol import MAX_CODE, Opcode, parse_reply, unsigned_values
from aero.safety import Region, SafetyStopError, Thresholds
from aero.safety.regions import Gate
from firmware_emulator.links.in_process import InProcessLink
from hil.recordings.policy_run import record_policy
from hil.recordings.recorder import Recorder

ABDUCTION, FLEXION = Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION
BINDS = {"thumb_abduction": {"below": 0.6}, "thumb_cmc_flexion": {"below": 0.3}}
"""Where the thumb of one physical hand binds at 3.1 A."""
LIMITS = Thresholds(forbidden=(Region.of(BINDS),))
POLL, PERIOD_S = 8, 0.005
shares = st.floats(0.0, 1.0, width=32)
poses = st.lists(shares, min_size=7, max_size=7).map(np.array)


def codes_of(pose):
    return np.rint(np.asarray(pose) * MAX_CODE).astype(int)


def read(pose):
    """Return a pose as encoders read it: within half a code, a hand is on the edge."""
    return codes_of(pose) / MAX_CODE


def pose(abduction, flexion):
    found = np.zeros(7)
    found[[ABDUCTION, FLEXION]] = abduction, flexion
    return found


def of(first, second, one, two):
    return Region.of({first: {one[0]: one[1]}, second: {two[0]: two[1]}})


edges = st.tuples(st.sampled_from(["below", "above"]), st.floats(0.05, 0.95))
regions = st.builds(of, st.just("thumb_abduction"), st.just("thumb_cmc_flexion"), edges, edges)


@settings(max_examples=100)
@given(
    region=regions,
    start=poses,
    goals=st.lists(st.tuples(st.integers(0, 30), poses), max_size=8),
    late=st.integers(0, 6),
    speeds=st.lists(st.floats(0.005, 0.03), min_size=7, max_size=7),
)
def test_no_commands_move_a_hand_into_a_region(region, start, goals, late, speeds):
    """Channels have speeds of their own, readings are up to 30 ms old, and a hand may begin inside."""
    gate, at = Gate([region]), start.copy()
    goal, past = at.copy(), [at.copy()]
    began_inside, due = region.holds(read(at)), list(goals)
    pause = 0
    for tick in range(400):
        past.append(at.copy())
        if tick % POLL == 0:
            reading = past[max(0, len(past) - 1 - late)]
            gate.seen(codes_of(reading))
            began_inside = began_inside and region.holds(read(reading))
            if (further := gate.released()) is not None:
                goal = further / MAX_CODE
        if due and pause >= due[0][0]:
            goal, pause = gate.passed(codes_of(due.pop(0)[1])) / MAX_CODE, 0
        pause += 1
        at = at + np.clip(goal - at, -np.array(speeds), speeds)
        assert began_inside or not region.holds(read(at))
    assert not goals or not region.holds(read(at)), "a commanded hand leaves its region"


def test_a_command_goes_round_the_corner_once_the_other_channel_is_out():
    gate = Gate(LIMITS.forbidden)
    gate.seen(codes_of(pose(0.9, 0.05)))
    at_the_edge = gate.passed(codes_of(pose(0.2, 0.8)))
    assert 0.62 < at_the_edge[ABDUCTION] / MAX_CODE < 0.65
    assert gate.released() is None
    for flexion in (0.2, 0.5, 0.8):
        gate.seen(codes_of(pose(0.62, flexion)))
        released = gate.released()
        assert (released is None) == (flexion != 0.5)
        if released is not None:
            np.testing.assert_array_equal(released, codes_of(pose(0.2, 0.8)))


WRONG = {
    "one channel": {"thumb_abduction": {"below": 0.6}},
    "unknown channel": {"thumb": {"below": 0.6}, "ring": {"below": 0.3}},
    "two sides": {"index": {"below": 0.6, "above": 0.1}, "ring": {"below": 0.3}},
    "edge of the window": {"index": {"below": 1.0}, "ring": {"below": 0.3}},
    "not a number": {"index": {"below": float("nan")}, "ring": {"below": 0.3}},
    "true": {"index": {"below": True}, "ring": {"below": 0.3}},
}


@pytest.mark.parametrize("table", WRONG.values(), ids=WRONG)
def test_a_wrong_region_is_one_clear_line(table):
    with pytest.raises(ValueError, match=r"channel|edge|expected") as caught:
        Region.of(table)
    assert "\n" not in str(caught.value)


def test_a_region_survives_the_way_to_the_standby_process():
    region = Region.of(BINDS)
    assert Region.of(region.as_table()) == region
    assert str(region) == "thumb_abduction below 0.6 while thumb_cmc_flexion below 0.3"


class Logged(InProcessLink):
    def __init__(self, electronics):
        super().__init__(electronics)
        self.log = []


def entered(link):
    """Return the readings of a link's log inside the region of `LIMITS`, after the hand was outside once."""
    found = [
        unsigned_values(parse_reply(data)) / MAX_CODE
        for _, way, data in link.log
        if way == "<" and len(data) == 16 and data[0] == Opcode.GET_POS
    ]
    inside = [LIMITS.forbidden[0].holds(one) for one in found]
    first = inside.index(False)
    return sum(inside[first:])


@pytest.mark.parametrize("firmware", ["0.2.0", "pre"])
def test_a_guarded_hand_never_enters_and_never_stops(firmware):
    """The slow opening at the start leaves the region, in which an unhomed hand stands."""
    with guarded(firmware=firmware, thresholds=LIMITS, link=Logged) as target:
        for goal in (pose(0.9, 0.05), pose(0.0, 0.0), pose(0.1, 0.5), pose(0.0, 0.0), pose(0.9, 0.0), pose(0.2, 0.5)):
            target.hand.command_codes(codes_of(goal))
            wait(target, 1.0)
        shares = target.hand.read_codes() / MAX_CODE
        np.testing.assert_allclose(shares[[ABDUCTION, FLEXION]], (0.2, 0.5), atol=0.04)
        with pytest.raises(SafetyStopError, match="takes no torques"):
            target.hand.command_torques([0] * 7)
        target.hand.close()
        assert entered(target.wire._transport) == 0


def test_a_policy_goes_round_a_region():
    policy = find_policy("steady")
    with guarded(thresholds=LIMITS, link=Logged) as target:
        run = record_policy(target, Recorder(target, "policy"), policy, RunSettings(seconds=2.0, wait_s=0.1)).run
        target.hand.close()
        assert (run.ending, run.reason) == (Ending.TIME, "")
        assert entered(target.wire._transport) == 0
