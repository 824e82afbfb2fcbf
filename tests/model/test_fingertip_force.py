"""Force at a fingertip, the one figure of strength the paper gives: about 12 N at stall."""

from __future__ import annotations

import pytest
from measured_hand import fingertip_force


@pytest.mark.parametrize("finger", ["index", "middle", "ring", "pinky"])
def test_fingertip_force_at_stall(finger):
    assert fingertip_force(finger) == pytest.approx(12.0, abs=2.0)
