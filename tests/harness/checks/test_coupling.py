"""Coupling, on a recording made by hand."""

import numpy as np
import pytest

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.coupling import check as coupling
from tests.support.synthetic import held


def test_stops_are_the_recorded_ones():
    """CMC flexion stops at 70, 80 and 95 % and drags the flexor by 3, 8 and 5 %."""
    stops, drags, rest = (70.0, 80.0, 95.0), (3.0, -8.0, 5.0), 20.0
    command, answer = [np.zeros(7)], [np.zeros(7)]
    answer[0][Channel.THUMB_FLEXOR] = rest
    for abduction, stop, drag in zip((0.0, 50.0, 100.0), stops, drags, strict=True):
        for closed in (0, 1, 0):
            told, reached = np.zeros(7), np.zeros(7)
            told[Channel.THUMB_ABDUCTION] = reached[Channel.THUMB_ABDUCTION] = abduction
            told[Channel.THUMB_CMC_FLEXION] = 100.0 * closed
            reached[Channel.THUMB_CMC_FLEXION] = stop * closed
            reached[Channel.THUMB_FLEXOR] = rest + drag * closed
            command.append(told)
            answer.append(reached)
    percent = MAX_CODE / 100
    found = coupling.measure(held("coupling", np.array(command) * percent, 0.7, answer=np.array(answer) * percent))
    expected = {"stop_without_abduction": 70, "stop_abducted": 95}
    assert found["thumb_cmc_flexion"] == pytest.approx(expected)
