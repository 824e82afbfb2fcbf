"""The units `paper` and `ideal` stand for a simulator and a publication: the one table of limits flags them."""

import pytest

from hil.emulated.any_hand import open_target
from hil.verdict.findings import failed
from hil.verdict.validation import validate

THUMB = {
    "coupling/stop_without_abduction",
    "excursion/closed_percent",
    "excursion/fist_travel",
    "excursion/stop_current",
    "staircase/excursion_hand",
}
"""What a thumb that moves as published, and not as the measured hands do, cannot pass."""
KNOWN = {
    "paper": THUMB | {"audit/followed", "holding/holding_current", "replay/replay_delay", "staircase/spring_shape"},
    "ideal": THUMB
    | {
        "audit/followed",
        "audit/others_moved",
        "coupling/stop_abducted",
        "replay/replay_delay",
        "staircase/friction",
        "staircase/overshoot_hand_percent",
        "staircase/spring",
        "staircase/spring_shape",
    },
}


@pytest.mark.slow
@pytest.mark.parametrize("unit", KNOWN)
def test_they_fail_the_checks_that_are_known(unit):
    with open_target(unit=unit, homed=True) as target:
        result = validate(target)
    assert {f"{finding.experiment}/{finding.check}" for finding in failed(result.findings)} == KNOWN[unit]
