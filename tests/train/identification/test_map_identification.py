import numpy as np
import pytest
from figures.actuation_map import RoutedLengths, scores
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from aero.actuation import ActuationMap, load_coefficients
from aero.actuation.coefficients import coefficients_from_toml
from aero.channels import THUMB, Channel, Joint
from model import RoutedHand
from train.identification import map_identification
from train.identification.map_identification import (
    Capture,
    coefficient_toml,
    identify,
    least_squares,
    staircase,
)

PAPER = load_coefficients("paper")


@pytest.fixture(scope="module")
def result():
    return identify(RoutedHand())


def test_the_regression_agrees_with_the_published_one_but_for_abduction(result):
    published = np.array(PAPER.thumb_regression)
    difference = np.abs(result.regression.coefficients - published)
    within = (difference < 0.05 * np.abs(published)) | (difference < result.regression.standard_errors)
    assert within[:, 1:].all()
    # Abduction moves nothing in the simulator; both fits show misfit there, which stays under 0.01 rad/rad.
    assert np.abs(result.regression.coefficients[:, 0]).max() < 0.01
    assert (result.regression.r_squared > 0.999).all()


def test_the_inverse_agrees_with_the_published_one(result):
    np.testing.assert_allclose(result.coefficients.thumb_gain, PAPER.thumb_gain, rtol=0.02)
    np.testing.assert_allclose(result.coefficients.thumb_offset, PAPER.thumb_offset, rtol=0.02)
    assert min(fit.r_squared[0] for fit in result.inverse) > 0.999


def test_finger_intervals_agree_with_the_published_ones(result):
    np.testing.assert_allclose(result.coefficients.finger_lengths, PAPER.finger_lengths, atol=0.3e-3)
    excursions_mm = np.ptp(result.coefficients.finger_lengths, axis=1) * 1e3
    np.testing.assert_allclose(excursions_mm, [45.93, 46.06, 45.93, 45.64], atol=0.1)


@pytest.mark.parametrize("name", ["paper", "identified"])
def test_coefficients_predict_a_grid_that_they_were_not_fitted_on(name):
    residuals = scores()[f"{name}, grids over abduction"]
    np.testing.assert_array_less(residuals.joints_rms_rad, [0.010, 0.025, 0.025])
    np.testing.assert_array_less(residuals.round_trip_max_m, [0.13e-3, 0.55e-3])


def test_identified_coefficients_make_a_map_that_knows_its_name(result):
    codec = ActuationMap(result.coefficients)
    assert "'identified'" in codec.describe()
    nominal = [0.09, 0.09, 0.09, 0.09, 0.75, 0.035, 0.1]
    difference = codec.codes_from_lengths(nominal).astype(int) - ActuationMap().codes_from_lengths(nominal)
    assert 0 < np.abs(difference).max() < 0.01 * 65535


def test_the_shipped_file_is_what_identification_gives(result):
    shipped = load_coefficients("identified")
    made = coefficients_from_toml(coefficient_toml(result, "right"))
    assert made == result.coefficients
    assert shipped.name == made.name
    # MuJoCo's versions differ in the last digits of a settled joint.
    for field in ("finger_lengths", "thumb_gain", "thumb_offset"):
        np.testing.assert_allclose(getattr(shipped, field), getattr(made, field), rtol=1e-4)
    difference = np.subtract(shipped.thumb_regression, made.thumb_regression)
    assert (np.abs(difference) < 0.05 * result.regression.standard_errors).all()


def test_the_left_hand_is_identified_alike():
    left, right = (staircase(RoutedHand(hand), THUMB[1]) for hand in ("left", "right"))
    np.testing.assert_allclose(left.lengths, right.lengths, atol=1e-6)
    np.testing.assert_allclose(left.joints, right.joints, atol=1e-4)


def test_effective_radii_against_the_papers():
    hand = RoutedLengths()
    assert hand.radii(Joint.THUMB_CMC)[Channel.THUMB_CMC_FLEXION] == pytest.approx(12.64e-3, rel=0.01)
    flexor = hand.radii(Joint.THUMB_MCP, Joint.THUMB_IP)[Channel.THUMB_FLEXOR]
    assert flexor == pytest.approx(18.25e-3, rel=0.02)
    # The paper's figure is 16.8 % short of CAD's 21.94.
    assert flexor / 21.9372e-3 == pytest.approx(0.82, abs=0.01)
    # The simulator has no abduction coupling.
    coupled = hand.radii(Joint.THUMB_ABDUCTION)[[Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR]]
    assert np.abs(coupled).max() < 1e-9


def test_the_script_leaves_coefficients(result, tmp_path, monkeypatch, capsys):
    # Sweeping again would show nothing new.
    monkeypatch.setattr(map_identification, "identify", lambda hand: result)
    monkeypatch.setattr("sys.argv", ["map_identification"])
    monkeypatch.chdir(tmp_path)
    map_identification.main()
    assert "MCP by flexor cable" in capsys.readouterr().out
    assert load_coefficients(tmp_path / "coefficients.toml").name == "identified"


def capture_of(seed, n=60):
    rng = np.random.default_rng(seed)
    lengths = np.zeros((n, 7))
    lengths[:, 4:] = rng.uniform([0, 0.027, 0.084], [1.7, 0.038, 0.110], (n, 3))
    joints = rng.uniform(0.0, 1.0, (n, 16))
    return Capture(lengths, joints, np.repeat(np.arange(6), n // 6))


def regressors_of(capture):
    return np.column_stack([capture.lengths[:, 4:], np.ones(len(capture.lengths))])


@given(st.integers(0, 99), arrays(np.float64, (2, 4), elements=st.floats(-100.0, 100.0)))
def test_what_is_linear_in_the_regressors_is_recovered(seed, planted):
    planted[:, 0] += 200.0
    capture = capture_of(seed)
    x = regressors_of(capture)
    fit = least_squares(x, x @ planted.T, capture.sweep)
    np.testing.assert_allclose(x @ fit.coefficients.T, x @ planted.T, atol=1e-8)


def test_standard_errors_hold_when_errors_are_correlated_within_a_sweep():
    """Over many draws, the spread of the estimates is the standard error."""
    rng = np.random.default_rng(3)
    sweep = np.repeat(np.arange(40), 10)
    x = np.column_stack([np.repeat(rng.uniform(-1, 1, 40), 10), np.ones(400)])
    estimates, errors = [], []
    for _ in range(300):
        shared = np.repeat(rng.normal(size=40), 10) + 0.1 * rng.normal(size=400)
        fit = least_squares(x, (2.0 * x[:, 0] + shared)[:, np.newaxis], sweep)
        estimates.append(fit.coefficients[0, 0])
        errors.append(fit.standard_errors[0, 0])
    assert np.mean(errors) == pytest.approx(np.std(estimates), rel=0.1)
