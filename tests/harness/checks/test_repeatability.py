"""Repeatability, on a recording made by hand."""

import numpy as np
import pytest

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.repeatability import check as repeatability
from tests.support.synthetic import held

WINDOW = (45.258, 45.258, 45.258, 45.258, 1745.33, 16.356, 41.222)
"""Of firmware 0.2.0, mm of cable, abduction mrad."""


def test_the_spread_is_that_of_the_ends_of_the_closures():
    """Three closures end at 50 %, at 1 to 7 % more, and at 49 %; on their way they are elsewhere."""
    shares = np.arange(1, 8) / 100
    command, answer = [np.zeros(7)], [np.zeros(7)]
    for closed in (np.full(7, 0.5), 0.5 + shares, np.full(7, 0.49)):
        command += [np.full(7, 0.5), np.full(7, 0.5), np.zeros(7)]
        answer += [np.full(7, 0.3), closed, np.zeros(7)]
    recording = held("repeatability", np.array(command) * MAX_CODE, 0.6, answer=np.array(answer) * MAX_CODE)
    found = repeatability.measure(recording)
    for channel in Channel:
        expected = (0.01 + shares[channel]) * WINDOW[channel]
        assert found[channel.label]["closure_spread"] == pytest.approx(expected, rel=2e-3)
