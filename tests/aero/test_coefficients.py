from dataclasses import replace
from importlib import resources

import numpy as np
import pytest

from aero.actuation import load_coefficients
from aero.actuation.coefficients import coefficients_from_toml

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


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("thumb_gain =", "thumb_gian =", "'thumb_gain' is missing"),
        ("pip = 7.3211e-3, ", "", "one winding radius for each of"),
        ("  [0.0616733, 0.10775],  # ring\n", "", r"finger_lengths must have shape \(4, 2\)"),
        ("[0.0616733, 0.10775],", "[0.10775, 0.0616733],", r"\[shortest, longest\]"),
        ("-0.977220399", "nan", "thumb_gain must be finite"),
        ("-0.977220399", "0.0", "must not hold a zero"),
        ("mcp = 9.4372e-3, ip = 12.5e-3", "mcp = 0.0, ip = 0.0", "singular for CMC against MCP"),
        ("spool_radius = 9.0e-3", "spool_radius = -9.0e-3", "spool_radius must be positive"),
        ("thumb_offset = [0.037517992, ", "thumb_offset = [", r"thumb_offset must have shape \(2,\)"),
    ],
)
def test_a_broken_file_is_refused_with_the_reason(old, new, says):
    assert old in TEXT
    with pytest.raises(ValueError, match=says):
        coefficients_from_toml(TEXT.replace(old, new))
