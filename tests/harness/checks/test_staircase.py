"""The command stream is what its description says, whatever its parameters."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.checks.shared.signals import find_steps
from hil.checks.staircase.check import Staircase

OPEN = np.array([0.1075, 0.1082, 0.1075, 0.1093, 0.0, 0.0379, 0.11])
CLOSED = np.array([0.0616, 0.0621, 0.0616, 0.0637, 1.75, 0.0269, 0.0834])


@given(st.integers(1, 25), st.integers(1, 30), st.integers(0, 50))
def test_each_channel_climbs_in_equal_levels_and_returns(levels, hold, lead):
    plan = Staircase(levels=levels, hold_s=0.02 * hold, lead_s=0.02 * lead)
    commands = plan.commands(OPEN, CLOSED)
    assert len(commands) == lead + 7 * 2 * levels * hold
    np.testing.assert_array_equal(commands[-1], OPEN)
    assert all((row != OPEN).sum() <= 1 for row in commands)
    steps = find_steps(0.02 * np.arange(len(commands) + 1), np.vstack([OPEN, commands]))
    for channel in range(7):
        own = [step for step in steps if step.channel == channel]
        fractions = [(step.after - OPEN[channel]) / (CLOSED - OPEN)[channel] for step in own]
        expected = [*range(1, levels + 1), *range(levels - 1, -1, -1)]
        np.testing.assert_allclose(fractions, np.array(expected) / levels, atol=1e-12)
        np.testing.assert_allclose(np.diff([step.start for step in own]), plan.hold_s)


def test_the_default_takes_about_134_s():
    assert 0.02 * len(Staircase().commands(OPEN, CLOSED)) == pytest.approx(134.4 + 0.96)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"hold_s": 0.47}, "hold_s must be a multiple"),
        ({"lead_s": 0.01}, "lead_s must be a multiple"),
        ({"sample_period_s": 0.015, "hold_s": 0.45, "lead_s": 0.9}, "simulator's step"),
        ({"levels": 0}, "at least one level"),
    ],
)
def test_a_stream_that_cannot_be_sampled_is_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        Staircase(**changes)
