"""The experiments of `aero-hil validate`, with the same limits, on whatever hand is there."""

import numpy as np
import pytest

from aero.channels import Channel
from hil import Target
from hil.checks import DEFAULT, EXPERIMENTS
from hil.verdict.findings import failed
from hil.verdict.run_end import EndKind
from hil.verdict.validation import Validation, validate

pytestmark = pytest.mark.moves
NAMES = [name for name in EXPERIMENTS if name in DEFAULT or name == "short_staircase"]
QUICK = ("presence", "audit", "response", "short_staircase", "replay")
"""Signs and channels, delays, rise time and tracking, and an open-loop replay: a minute of hand time."""
LONG = {name: [pytest.mark.takes_long] for name in NAMES if name not in QUICK}
LONG["staircase"].append(pytest.mark.slow)


def judged(target: Target, name: str) -> Validation:
    """Run an experiment; skip the test where this computer was held up too often for a verdict."""
    result = validate(target, [name])
    if result.end.kind is EndKind.HOST_BUSY:
        pytest.skip(f"not judged: {result.end.reason}")
    return result


@pytest.mark.parametrize("name", [pytest.param(name, marks=LONG.get(name, [])) for name in NAMES])
def test_within_limits(target, hand, name):
    if EXPERIMENTS[name].pushes_at_stops and not target.may_push_at_stops:
        pytest.skip(f"firmware {target.firmware} cannot weaken the thumb at its stops; run with --hil=emulated")
    result = judged(target, name)
    assert result.end.finding is None, result.end.finding.sentence
    described = {(subject, metric.name) for metric in EXPERIMENTS[name].metrics for subject in metric.subjects}
    measured = result.results[name].measured
    # What a host that was late could not tell is not there.
    unknown = {(subject, metric) for subject, row in measured.items() for metric in row} - described
    assert not unknown, f"measured without a description: {sorted(unknown)}"
    empty = sorted(subject for subject, row in measured.items() if not row)
    assert not empty, f"nothing was measured on {', '.join(empty)}"
    assert [finding.sentence for finding in failed(result.findings)] == []


@pytest.mark.needs_ground_truth
def test_the_encoders_tell_the_truth(target, hand, settle, open_codes):
    """They know how far a shaft has turned; where they count from is what homing found."""
    plant = target.truth.plant
    goal = open_codes.copy()
    start = target.map.angles_from_codes(settle(goal))[Channel.MIDDLE], plant.angles()[Channel.MIDDLE]
    goal[Channel.MIDDLE] = 40000
    end = target.map.angles_from_codes(settle(goal))[Channel.MIDDLE], plant.angles()[Channel.MIDDLE]
    off_deg = np.rad2deg((end[0] - start[0]) - (end[1] - start[1]))
    assert abs(off_deg) < 1.0, f"angle read less angle turned {off_deg:.2f}°, should be less than 1°"
    bent = plant.joint_angles()[3:6]
    assert np.all(bent > 0.2), f"joints of the closed middle finger {bent.round(2)} rad, should be more than 0.2 rad"


@pytest.mark.homes
@pytest.mark.takes_long
def test_homing_repeats(target, hand):
    """From here on the zero is the one that homing found; the plugin puts such tests last in any order."""
    result = judged(target, "homing")
    assert [finding.sentence for finding in failed(result.findings)] == []
