"""Force at a fingertip, the one figure of strength the paper gives: about 12 N for each finger and the thumb."""

import pytest
from measured_hand import fingertip_force

PAPER_N = 12.0
"""Paper, Grasp diversity and fingertip force."""


@pytest.mark.parametrize("finger", ["index", "middle", "ring", "pinky"])
def test_fingertip_force_at_stall(finger):
    assert fingertip_force(finger) == pytest.approx(PAPER_N, abs=2.0)


def test_the_papers_force_of_the_thumb_lies_between_those_of_its_two_cables():
    """Neither posture nor motor is published; the flexor presses harder, as the base then rests at its open stop."""
    flexor, flexion = fingertip_force("thumb", "thumb_flexor"), fingertip_force("thumb", "thumb_cmc_flexion")
    assert flexor == pytest.approx(17.7, abs=0.5)
    assert flexion == pytest.approx(7.9, abs=0.5)
    assert flexion < PAPER_N < flexor
