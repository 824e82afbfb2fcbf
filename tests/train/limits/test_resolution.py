"""Resolutions follow from window, registers and sample rate."""

import pytest

from hil.checks import BOUNDS
from train.limits.resolution import resolution

COMPUTED = [bound for bound in BOUNDS if not bound.given]
WITHOUT = {"rise_hand_ms", "open_close_rate", "spring_shape"}
"""Interpolated, or a ratio."""


@pytest.mark.parametrize(
    ("metric", "subject", "expected"),
    [
        ("friction", "index", 0.0065),
        ("fist_travel", "index", 45.26 * 20 / 65535),
        ("closed_percent", "index", 100 * 20 / 65535),
        ("followed", "thumb_abduction", 100 / 0.2 * 58 / 65535),
        ("overshoot_hand_percent", "index", 2000 * 20 / 65535 / 0.8),
        ("take_up", "index", 45.26 / 20),
        ("replay_delay", "ring", 5.0),
        ("command_to_motion", "hand", 1.0),
        ("matched_steps", "ring", 1.0),
    ],
)
def test_a_resolution_is_one_count_one_sample_or_one_quantum(metric, subject, expected):
    bound = next(one for one in COMPUTED if one.metric == metric and subject in one.subjects)
    assert resolution(bound, ("0.1.5",)) == pytest.approx(expected, rel=1e-3)


def test_every_computed_limit_has_one_but_those_of_interpolated_quantities():
    for bound in COMPUTED:
        assert (resolution(bound, ("0.1.5", "0.2.0")) == 0.0) == (bound.metric in WITHOUT), bound
