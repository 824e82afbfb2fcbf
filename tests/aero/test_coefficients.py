from dataclasses import replace
from importlib import resources

import numpy as np

from aero.actuation import load_coefficients

PAPER = load_coefficients("paper")
TEXT = resources.files("aero.actuation.coefficients").joinpath("paper.toml").read_text(encoding="utf-8")


def test_the_paper_prints_the_leading_digits_of_its_coefficients():
    np.testing.assert_allclose(np.multiply(PAPER.finger_winding, 1e3), [12.49, 7.32, 9.00], atol=5e-3)
    np.testing.assert_allclose(
        np.multiply(PAPER.thumb_winding, 1e3), [[2.5, 12.49, 0, 0], [2.5, -2.5, 9.44, 12.5]], atol=5e-3
    )
    printed = [[3.4e-4, -78.09, 0.19, 2.977], [4.2e-3, -11.37, -56.72, 6.666], [4.5e-3, -11.42, -56.89, 6.687]]
    last_digit = np.array([[1e-5, 0.01, 0.01, 1e-3], [1e-4, 0.01, 0.01, 1e-3], [1e-4, 0.01, 0.01, 1e-3]])
    assert (np.abs(np.subtract(PAPER.thumb_regression, printed)) <= 0.51 * last_digit).all()
    np.testing.assert_allclose(np.multiply(PAPER.thumb_gain, 1e3), [-977.2, -1241.6], atol=0.05)
    np.testing.assert_allclose(np.multiply(PAPER.thumb_offset, 1e3), [37.52, 136.59], atol=5e-3)
    sweeps_mm = np.ptp(PAPER.finger_lengths, axis=1) * 1e3
    np.testing.assert_allclose([sweeps_mm.min(), sweeps_mm.max()], [45.72, 46.21], atol=5e-3)


def test_a_file_elsewhere_loads_like_a_shipped_one(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(TEXT.replace('name = "paper"', 'name = "mine"'), encoding="utf-8")
    assert load_coefficients(path) == replace(PAPER, name="mine")
