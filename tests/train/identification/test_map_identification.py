import numpy as np
import pytest
from figures.actuation_map import RoutedLengths, scores

from aero.actuation import load_coefficients
from aero.actuation.coefficients import coefficients_from_toml
from aero.channels import Channel, Joint
from simulator import RoutedHand
from train.identification import map_identification
from train.identification.map_identification import coefficient_toml, identify

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
