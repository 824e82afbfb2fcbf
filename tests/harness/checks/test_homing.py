"""Homing, on a recording made by hand."""

import numpy as np
import pytest

from aero.channels import CABLES, Channel
from aero.protocol import MAX_CODE
from hil.checks.homing import check as homing
from tests.support.synthetic import held

WINDOW_MM = {**dict.fromkeys(range(4), 45.258), Channel.THUMB_CMC_FLEXION: 16.356, Channel.THUMB_FLEXOR: 41.222}
"""Cable travel of a channel's whole window on firmware 0.2.0."""


def test_time_and_spread_are_the_recorded_ones():
    """Each cable closes three times, to 90 %, to 1 to 6 % less, and to 92 %; the slowest homing took 12.5 s."""
    command, answer = [np.zeros(7)], [np.zeros(7)]
    for homed in range(3):
        for i, channel in enumerate(CABLES):
            for closed in (1, 0):
                command.append(np.eye(7)[channel] * closed)
                answer.append(np.eye(7)[channel] * closed * (0.9, 0.89 - 0.01 * i, 0.92)[homed])
    recording = held("homing", np.array(command) * MAX_CODE, 0.9, answer=np.array(answer) * MAX_CODE, slowest_s=12.5)
    found = homing.measure(recording)
    for i, channel in enumerate(CABLES):
        expected = (0.03 + 0.01 * i) * WINDOW_MM[channel]
        assert found[channel.label]["homing_spread"] == pytest.approx(expected, abs=0.002)
    assert Channel.THUMB_ABDUCTION.label not in found
