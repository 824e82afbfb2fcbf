import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from aero import JOINT_BOX_RAD, UNSHIFTED, ActuationMap, Channel, CommandWindow, Joint
from aero.firmware import FIRMWARE

MAP = ActuationMap()
WINDOWS = [
    CommandWindow.for_firmware(version, state, hand)
    for version, state in [("0.1.5", "unshifted"), ("0.2.0", "homed"), ("0.2.0", "mixed")]
    for hand in ("right", "left")
]
# Sensor extremes of the simulator (aero-hand-open 7084ad3) and abduction's range.
WORKSPACE = np.array(
    [
        *MAP.coefficients.finger_lengths,
        [0.0, np.deg2rad(100.0)],
        [0.026941, 0.0382787],
        [0.0839985, 0.110133],
    ]
)
UNIT = arrays(np.float64, (5, 7), elements=st.floats(0.0, 1.0))


def in_workspace(unit):
    return WORKSPACE[:, 0] + unit * (WORKSPACE[:, 1] - WORKSPACE[:, 0])


def test_excursions_follow_from_the_joint_box():
    published = [[0, 288.16]] * 4 + [[0, 100], [0, 104.13], [-15.28, 247.15]]
    np.testing.assert_allclose(np.rad2deg(MAP.excursion_rad)[:4], published[:4], atol=4e-2)
    np.testing.assert_allclose(np.rad2deg(MAP.excursion_rad)[4:], published[4:], atol=6e-3)


def test_no_vertex_of_the_joint_box_lies_outside_the_excursions_and_some_reach_them():
    picks = (np.arange(2**16)[:, np.newaxis] >> np.arange(16)) & 1
    vertices = np.where(picks, JOINT_BOX_RAD[:, 1], JOINT_BOX_RAD[:, 0])
    angles = MAP.angles_from_travel(MAP.travel_from_joints(vertices))
    np.testing.assert_allclose(
        np.stack([angles.min(axis=0), angles.max(axis=0)], axis=1), MAP.excursion_rad, atol=1e-12
    )
    # What the hand is commanded against, aero-open-sdk 0.1.0.dev1.
    commanded = [[0, 288.1603]] * 4 + [[0, 100], [0, 104.1250], [-15.2789, 247.1500]]
    difference = np.abs(np.rad2deg(MAP.excursion_rad) - commanded).max(axis=1)
    assert difference[:4].max() < 3.8e-2
    assert difference[4:].max() < 1.13e-3


def test_the_flexor_unwinds_below_its_extended_reading_when_the_cmc_joint_flexes():
    posture = np.zeros(16)
    posture[Joint.THUMB_CMC] = JOINT_BOX_RAD[Joint.THUMB_CMC, 1]
    travel = MAP.travel_from_joints(posture)
    assert travel[Channel.THUMB_FLEXOR] == pytest.approx(-2.4e-3, abs=1e-5)
    assert MAP.codes_from_joints(posture)[Channel.THUMB_FLEXOR] == 0
    assert MAP.codes_from_joints(np.zeros(16))[Channel.THUMB_FLEXOR] == 3815


def test_the_winding_matrix_has_full_rank_and_one_negative_entry():
    assert MAP.winding_matrix.shape == (7, 16)
    assert np.linalg.matrix_rank(MAP.winding_matrix) == 7
    assert np.argwhere(MAP.winding_matrix < 0).tolist() == [[Channel.THUMB_FLEXOR, Joint.THUMB_CMC]]


@pytest.mark.parametrize("window", WINDOWS, ids=lambda w: f"{w.name}-{w.side}")
def test_every_code_of_every_channel_survives_every_stage_that_inverts(window):
    codec = ActuationMap(window=window)
    codes = np.broadcast_to(np.arange(65536)[:, np.newaxis], (65536, 7))
    angles = codec.angles_from_codes(codes)
    np.testing.assert_array_equal(codec.codes_from_angles(angles), codes)
    travel = codec.travel_from_angles(angles)
    np.testing.assert_array_equal(codec.codes_from_angles(codec.angles_from_travel(travel)), codes)
    compact = codec.compact_from_travel(travel)
    np.testing.assert_array_equal(codec.codes_from_compact(compact), codes)


@pytest.mark.parametrize("window", WINDOWS, ids=lambda w: f"{w.name}-{w.side}")
@given(unit=UNIT)
def test_a_length_comes_back_within_half_a_code_but_for_the_thumb_cables(window, unit):
    codec = ActuationMap(window=window)
    lengths = in_workspace(unit)
    angles = codec.angles_from_travel(codec.travel_from_lengths(lengths))
    codes, saturated = codec.saturating_codes(angles)
    back = codec.lengths_from_codes(codes)
    one_code = np.abs(codec.lengths_from_codes(np.full(7, 1)) - codec.lengths_from_codes(np.zeros(7, int)))
    error = np.where(saturated, 0.0, np.abs(back - lengths))[:, : Channel.THUMB_CMC_FLEXION]
    assert (error <= 0.5001 * one_code[: Channel.THUMB_CMC_FLEXION] + 1e-15).all()


def test_the_two_fits_of_the_thumb_cables_disagree_by_a_stated_bound():
    # The composition is affine, so the extremes over the workspace are at its corners.
    corners = np.array(list(itertools.product(*WORKSPACE[4:])))
    lengths = np.hstack([np.broadcast_to(WORKSPACE[:4, 0], (len(corners), 4)), corners])
    error = MAP.lengths_from_travel(MAP.travel_from_lengths(lengths)) - lengths
    np.testing.assert_allclose(np.abs(error).max(axis=0)[5:], [0.0796e-3, 0.5719e-3], atol=0.0001e-3)
    assert np.abs(error[:, :5]).max() < 1e-15


@given(unit=UNIT, channel=st.sampled_from(Channel), step=st.floats(1e-3, 1.0))
def test_abduction_opens_up_with_its_length_and_everything_else_closes_as_its_cable_shortens(unit, channel, step):
    lengths = in_workspace(unit)
    further = lengths.copy()
    further[:, channel] += step * (WORKSPACE[channel, 1] - WORKSPACE[channel, 0])
    before, after = (MAP.angles_from_travel(MAP.travel_from_lengths(x))[:, channel] for x in (lengths, further))
    expected = 1 if channel == Channel.THUMB_ABDUCTION else -1
    assert (np.sign(after - before) == expected).all()


@given(unit=UNIT, finger=st.sampled_from(range(4)))
def test_a_finger_moves_its_own_channel_only(unit, finger):
    lengths = in_workspace(unit)
    moved = lengths.copy()
    moved[:, finger] = WORKSPACE[finger, 0]
    difference = MAP.travel_from_lengths(moved) - MAP.travel_from_lengths(lengths)
    assert not np.delete(difference, finger, axis=1).any()


@given(arrays(np.float64, st.tuples(*[st.integers(0, 3)] * 2, st.just(7)), elements=st.floats(0.0, 1.0)))
def test_leading_axes_are_carried_along(unit):
    lengths = in_workspace(unit)
    codes = MAP.codes_from_lengths(lengths)
    assert codes.shape == lengths.shape
    assert codes.dtype == np.uint16
    for index in np.ndindex(unit.shape[:2]):
        np.testing.assert_array_equal(codes[index], MAP.codes_from_lengths(lengths[index]))


def test_the_deployed_nominal_pose_gets_the_published_commands():
    # aero-hand-open 7084ad3: 155.06, 164.62, 161.04, 148.13, 42.97, 32.89, 91.65 degrees for its default command.
    codes = MAP.codes_from_lengths([0.083, 0.082, 0.082, 0.086, 0.75, 0.035, 0.1])
    np.testing.assert_allclose(codes / 65535, [0.538, 0.571, 0.559, 0.514, 0.430, 0.316, 0.407], atol=5e-4)


@pytest.mark.parametrize(
    ("angles_deg", "says"),
    [
        ([0, 0, 0, 0, 0, 0, -16.0], r"thumb_flexor at -16.00° \(1 in all\), window -15.28..247.15°"),
        ([289, 0, 0, 0, 101.5, 0, 0], r"index at 289.00°.*thumb_abduction at 101.50°"),
        ([0, 0, 0, 0, 0, float("nan"), 0], "thumb_cmc_flexion at nan°"),
        ([float("inf"), 0, 0, 0, 0, 0, 0], "index at inf°"),
    ],
)
def test_what_is_outside_the_window_is_refused_by_channel(angles_deg, says):
    with pytest.raises(ValueError, match=says):
        MAP.codes_from_angles(np.deg2rad(angles_deg))


@given(arrays(np.float64, (3, 7), elements=st.floats(-10.0, 10.0)))
def test_saturation_reports_what_it_changed(angles):
    codes, saturated = MAP.saturating_codes(angles)
    low, high = MAP.window_rad.T
    code_rad = (high - low) / 65535
    np.testing.assert_array_equal(saturated, (angles < low - 0.5 * code_rad) | (angles > high + 0.5 * code_rad))
    np.testing.assert_allclose(MAP.angles_from_codes(codes), np.clip(angles, low, high), atol=1e-4)


def test_the_window_decides_where_the_same_posture_is_found():
    posture = np.deg2rad([10.0, 10.0, 10.0, 10.0, 50.0, 30.0, 20.0])
    codes = {
        state: ActuationMap.for_firmware("0.2.0", state).codes_from_compact(posture)
        for state in FIRMWARE["0.2.0"].calibration_states
    }
    shift = 113 / 4096 * 360
    homed, unshifted, mixed = (codes[state].astype(float) for state in ("homed", "unshifted", "mixed"))
    assert homed[4] - unshifted[4] == pytest.approx(-shift / 100 * 65535, abs=1)
    assert homed[5] - unshifted[5] == pytest.approx(shift / 104.1245 * 65535, abs=1)
    assert mixed[4] == pytest.approx((50 - shift) / (100 - shift) * 65535, abs=1)
    assert (homed == unshifted).tolist() == [True] * 4 + [False] * 2 + [True]


def test_maps_compare_and_hash_by_what_they_hold():
    assert ActuationMap() == ActuationMap(window=UNSHIFTED)
    assert hash(ActuationMap()) == hash(ActuationMap(window=UNSHIFTED))
    assert ActuationMap.for_firmware("0.2.0") != ActuationMap()
