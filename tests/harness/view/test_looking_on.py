"""Whoever looks at a hand changes nothing of it, and sees what is there."""

import threading
from contextlib import contextmanager, nullcontext

import numpy as np
import pytest
from recorded import staircase_of

from aero.channels import CABLES, Channel
from hil.checks.staircase.check import Staircase
from hil.emulated.any_hand import open_target
from hil.emulated.faults import parse_fault
from hil.view.sources import WireSource, frames, source_of

HALF_CLOSED = [0.6, 0.7, 0.8, 0.9, 0.5, 0.3, 0.6]
"""Compact posture, rad."""


@contextmanager
def looked_at(target):
    """Somebody looks all the time, without a pause; what was seen."""
    source, done, seen = source_of(target), threading.Event(), []

    def look():
        while not done.is_set():
            seen.append(source.frame())

    thread = threading.Thread(target=look)
    thread.start()
    try:
        yield seen
    finally:
        done.set()
        thread.join()


def move(target):
    """Close and open the hand in small steps."""
    closed = target.map.codes_from_compact(HALF_CLOSED).astype(float)
    for share in np.concatenate([np.linspace(0.0, 1.0, 25), np.linspace(1.0, 0.0, 25)]):
        target.hand.command_codes((share * closed).astype(int))
        target.clock.sleep_until(target.clock.now() + 0.04)
        target.hand.read_codes()
        target.hand.read_currents()


def bytes_of_a_hand(watching, faults):
    with open_target(seed=3, faults=[parse_fault(fault) for fault in faults]) as target:
        with watching(target) as seen:
            move(target)
        return target.wire.since(0, 0.0), seen


@pytest.mark.parametrize("faults", [(), ("cable_snapped:ring@0.8",)])
def test_the_bytes_are_the_same_whether_somebody_looks_or_not(faults):
    """Also while the hand becomes another one, with a cable that is torn."""
    alone, _ = bytes_of_a_hand(lambda target: nullcontext(), faults)
    watched, seen = bytes_of_a_hand(looked_at, faults)
    assert watched == alone
    # How many looks a run leaves room for depends on the machine; several have to be among them.
    assert len({frame.t for frame in seen}) > 2


def test_of_an_emulated_hand_the_truth_is_seen():
    with open_target(faults=[parse_fault("cable_long:index=7.6")]) as target:
        source = source_of(target)
        plant = target.truth.plant
        asked = target.map.codes_from_compact(HALF_CLOSED)
        target.hand.command_codes([2000, *asked[1:]])
        target.clock.sleep_until(target.clock.now() + 1.5)
        frame = source.frame()
        assert frame.t == plant.time
        np.testing.assert_array_equal(frame.joints, plant.joint_angles())
        np.testing.assert_allclose(frame.measured, plant.angles(), atol=np.deg2rad(1.0))
        np.testing.assert_allclose(frame.commanded[1:], target.map.angles_from_codes(asked)[1:], atol=np.deg2rad(1.0))
        np.testing.assert_allclose(frame.commanded, frame.measured, atol=np.deg2rad(5.0))
        assert np.all((frame.temperatures > 20) & (frame.temperatures < 60))
        assert np.all((frame.currents >= 0) & (frame.currents < 4))
        slack = frame.loose > 1e-4
        assert [channel for channel in CABLES if slack[channel]] == [Channel.INDEX]
        assert frame.tensions[Channel.INDEX] == 0.0
        assert frame.tensions[Channel.RING] > 1.0
        assert np.isnan(frame.loose[Channel.THUMB_ABDUCTION])


def test_a_hand_at_rest_is_commanded_where_it_is():
    with open_target() as target:
        target.hand.command_codes(target.map.codes_from_compact(HALF_CLOSED))
        target.clock.sleep_until(target.clock.now() + 2.0)
        frame = source_of(target).frame()
    np.testing.assert_allclose(frame.commanded_joints, frame.joints, atol=np.deg2rad(5.0))


def test_of_any_other_hand_what_its_link_says_is_seen():
    with open_target() as target:
        source = WireSource(target.map)
        assert source.frame() is None
        target.wire.listeners.append(source.take)
        asked = target.map.codes_from_compact(HALF_CLOSED)
        target.hand.command_codes(asked)
        target.clock.sleep_until(target.clock.now() + 1.5)
        codes, currents = target.hand.read_codes(), target.hand.read_currents()
        temperatures = target.hand.read_temperatures()
        frame = source.frame()
    joints = target.map.joints_from_compact(target.map.compact_from_codes(codes))
    np.testing.assert_allclose(frame.joints, joints)
    np.testing.assert_allclose(frame.measured, target.map.angles_from_codes(codes))
    np.testing.assert_allclose(frame.commanded, target.map.angles_from_codes(asked))
    np.testing.assert_allclose(frame.currents, np.abs(currents))
    np.testing.assert_allclose(frame.temperatures, temperatures)
    assert np.isnan(frame.loose).all()


def test_a_joint_is_not_shown_beyond_its_stop():
    """A shaft goes on opening when its finger lies at the open stop."""
    with open_target() as target:
        emulated, wire = source_of(target), WireSource(target.map)
        target.wire.listeners.append(wire.take)
        target.hand.command_codes([0] * len(Channel))
        target.clock.sleep_until(target.clock.now() + 1.5)
        target.hand.read_codes()
        for frame in (emulated.frame(), wire.frame()):
            assert frame.measured[Channel.THUMB_FLEXOR] < -0.1
            assert frame.commanded_joints.min() == 0.0
        assert wire.frame().joints.min() == 0.0


def test_a_recording_is_played_as_it_was():
    with open_target() as target:
        recording = staircase_of(target, Staircase(levels=2))
    played = frames(recording)
    times = np.array([frame.t for frame in played])
    assert np.all(np.diff(times) >= 1 / 30)
    assert times[-1] > 0.9 * recording.header.duration_s
    assert np.ptp([frame.joints for frame in played], axis=0).max() > 0.3
