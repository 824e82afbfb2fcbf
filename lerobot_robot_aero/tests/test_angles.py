import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from lerobot_robot_aero.angles import CURRENTS, POSITIONS, AngleMap, listed, named

from aero.actuation import ActuationMap
from aero.channels import JOINT_BOX_RAD, Joint
from aero.firmware import FIRMWARE

maps = st.builds(
    lambda firmware, hand: ActuationMap.for_firmware(firmware, side=hand),
    st.sampled_from(sorted(FIRMWARE)),
    st.sampled_from(["right", "left"]),
)
CODES = arrays(np.uint16, 7)


@given(maps, st.tuples(*[st.floats(-0.01, 0.01)] * 7), CODES)
def test_codes_are_the_same_after_the_way_to_degrees_and_back(codec, slack, codes):
    angles = AngleMap(codec, slack)
    assert angles.codes(angles.degrees(codes)).tolist() == codes.tolist()


def test_slack_is_taken_up_before_a_finger_moves():
    """The fingers' cables wind 3 mm first; one degree of a finger's three joints takes the same travel of each."""
    codec = ActuationMap.for_firmware("0.1.5")
    finger = float(codec.winding_matrix[0].sum()) * math.radians(1.0)
    slack = (0.003,) * 4 + (0.0,) * 3
    tight, loose = AngleMap(codec).codes([20.0] * 7), AngleMap(codec, slack).codes([20.0] * 7)
    more_degrees = (AngleMap(codec).degrees(loose) - AngleMap(codec).degrees(tight))[:4]
    np.testing.assert_allclose(more_degrees, 0.003 / finger, atol=0.01)
    assert loose[4:].tolist() == tight[4:].tolist()


def test_a_hand_as_the_map_describes_it_has_no_slack():
    codec = ActuationMap.for_firmware("0.2.0")
    assert AngleMap.corrected(codec, "none") == AngleMap(codec)
    np.testing.assert_allclose(AngleMap.corrected(codec, "ideal").slack, 0.0, atol=1e-6)


def test_an_unknown_unit_is_named():
    with pytest.raises(ValueError, match="nobody"):
        AngleMap.corrected(ActuationMap(), "nobody")


@given(maps, arrays(np.float64, 7, elements=st.floats(-400, 400)))
def test_any_angles_become_codes_and_what_is_sent_is_sent_again_unchanged(codec, degrees):
    sent = AngleMap(codec).degrees(AngleMap(codec).codes(degrees))
    again = AngleMap(codec).degrees(AngleMap(codec).codes(sent))
    np.testing.assert_array_equal(again, sent)


def test_the_extended_hand_is_zero_and_a_closed_finger_90_degrees():
    """Joint box of the paper, after eq. (actrange); firmware 0.1.5 has the paper's window."""
    codec = ActuationMap.for_firmware("0.1.5")
    fingers = slice(0, 4)
    assert AngleMap(codec).codes(np.zeros(7))[fingers].tolist() == [0] * 4
    assert AngleMap(codec).codes([90.0] * 7)[fingers].tolist() == [65535] * 4
    np.testing.assert_allclose(AngleMap(codec).degrees(np.array([65535] * 7))[fingers], 90.0, atol=1e-9)


@given(maps, st.data())
def test_angles_inside_the_window_come_back_to_the_width_of_a_code(codec, data):
    ends = np.rad2deg(JOINT_BOX_RAD[[0, 3, 6, 9, Joint.THUMB_ABDUCTION, Joint.THUMB_CMC, Joint.THUMB_MCP]])
    degrees = np.array([data.draw(st.floats(low, high)) for low, high in ends])
    travel = codec.travel_from_joints(codec.joints_from_compact(np.deg2rad(degrees)))
    inside = ~codec.saturating_codes(codec.angles_from_travel(travel)).saturated
    back = AngleMap(codec).degrees(AngleMap(codec).codes(degrees))
    if inside.all():
        np.testing.assert_allclose(back, degrees, atol=0.01)
    np.testing.assert_allclose(back[:4][inside[:4]], degrees[:4][inside[:4]], atol=0.01)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_an_angle_that_is_no_number_is_refused(bad):
    with pytest.raises(ValueError, match="finite"):
        AngleMap(ActuationMap()).codes([bad] + [0.0] * 6)


def test_names_are_in_command_order():
    assert POSITIONS == (
        "index.pos", "middle.pos", "ring.pos", "pinky.pos",
        "thumb_abduction.pos", "thumb_cmc_flexion.pos", "thumb_flexor.pos",
    )  # fmt: skip
    assert CURRENTS[0] == "index.current"
    assert named(range(7)) == {name: float(i) for i, name in enumerate(POSITIONS)}
    assert listed(dict(reversed(named(range(7)).items()))).tolist() == [0, 1, 2, 3, 4, 5, 6]


def test_a_missing_angle_is_named():
    with pytest.raises(ValueError, match=r"missing: ring\.pos"):
        listed({name: 0.0 for name in POSITIONS if name != "ring.pos"})


@pytest.mark.parametrize("kind", [float, np.float32, np.array, lambda value: np.array([value])])
def test_an_action_has_numbers_or_arrays_of_one_element(kind):
    angles = listed({name: kind(float(place)) for place, name in enumerate(POSITIONS)})
    assert angles.tolist() == list(range(7))
