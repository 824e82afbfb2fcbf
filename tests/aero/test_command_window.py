import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.actuation import CommandWindow
from aero.actuation.window import fits_span
from aero.channels import Channel
from aero.firmware import FIRMWARE

# Counts of aero-hand-open 6a3022d, abduction and CMC flexion, extend then grasp.
PUBLISHED = {
    ("right", "unshifted"): ((2048, 910), (3231, 2048)),
    ("right", "homed"): ((1935, 797), (3344, 2161)),
    ("right", "mixed"): ((1935, 910), (3344, 2048)),
    ("left", "unshifted"): ((2048, 3186), (865, 2048)),
    ("left", "homed"): ((2161, 3299), (752, 1935)),
    ("left", "mixed"): ((2161, 3186), (752, 2048)),
}


@pytest.mark.parametrize(("hand", "state"), PUBLISHED)
def test_the_thumb_windows_of_0_2_0_in_each_state(hand, state):
    window = CommandWindow.for_firmware("0.2.0", state, hand)
    ends = list(zip(window.extend_counts, window.grasp_counts, strict=True))
    assert tuple(ends[4:6]) == PUBLISHED[hand, state]
    assert ends[:4] == [(3278, 0) if hand == "right" else (817, 4095)] * 4
    assert ends[6] == ((1115, 4095) if hand == "right" else (2980, 0))


@pytest.mark.parametrize("state", ["homed", "mixed", "unshifted"])
def test_both_hands_have_the_same_windows_in_shaft_angles(state):
    right, left = (CommandWindow.for_firmware("0.2.0", state, hand).shifts_rad() for hand in ("right", "left"))
    np.testing.assert_array_equal(right, left)


def test_0_2_0_homed_moves_abduction_to_closed_and_flexion_to_open_by_113_counts():
    shift = 113 / 4096 * 360
    expected = np.zeros((7, 2))
    expected[4], expected[5] = shift, -shift
    for version in ("0.2.0", "main"):
        np.testing.assert_allclose(np.rad2deg(CommandWindow.for_firmware(version).shifts_rad()), expected)


@pytest.mark.parametrize("version", [v for v, row in FIRMWARE.items() if row.calibration_states == ("unshifted",)])
def test_earlier_firmwares_are_not_shifted(version):
    assert not CommandWindow.for_firmware(version).shifts_rad().any()
    with pytest.raises(ValueError, match=f"firmware {version} cannot be 'homed'"):
        CommandWindow.for_firmware(version, "homed")


def readings(window, counts):
    """What the firmware reports for shafts that many counts into their windows (C integer division of positives)."""
    return counts * 65535 // window.spans_counts()


@given(
    st.sampled_from(list(PUBLISHED)),
    st.lists(st.lists(st.integers(0, 1000), min_size=7, max_size=7), min_size=1, max_size=20),
)
def test_a_windows_own_readings_always_fit_it(key, counts):
    hand, state = key
    window = CommandWindow.for_firmware("0.2.0", state, hand)
    assert fits_span(readings(window, np.array(counts)), window.spans_counts()).all()


def test_the_mixed_state_shows_in_two_dozen_readings():
    counts = np.random.default_rng(1).integers(0, 1000, (24, 7))
    mixed = CommandWindow.for_firmware("0.2.0", "mixed")
    fits = fits_span(readings(mixed, counts), CommandWindow.for_firmware("0.2.0").spans_counts()).all(axis=0)
    assert [channel.label for channel in Channel if not fits[channel]] == ["thumb_abduction", "thumb_cmc_flexion"]


def test_a_trimmed_finger_shows_in_its_readings():
    """One physical hand's middle finger read in 3219ths for a day, found in its logs only afterwards."""
    counts = np.random.default_rng(2).integers(0, 3000, 12)
    codes = counts * 65535 // 3219
    assert fits_span(codes, 3219).all()
    assert not fits_span(codes, 3278).all()


def test_homed_and_unshifted_cannot_be_told_apart_by_readings():
    homed, unshifted = (CommandWindow.for_firmware("0.2.0", state) for state in ("homed", "unshifted"))
    assert fits_span(readings(unshifted, np.full((3, 7), 500)), homed.spans_counts()).all()
