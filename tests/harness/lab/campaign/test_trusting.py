"""What faulty hands teach: a model of places that tells those it was taught, and how far it is to be trusted."""

import numpy as np
import pytest

from aero.channels import Channel
from hil.faults import parse_fault
from hil.lab.campaign.placing import fit_places, usual_readings
from hil.lab.campaign.trusting import trust
from hil.verdict.deviation import deviation
from hil.verdict.explanation import Place
from hil.verdict.likeness import Likeness
from hil.verdict.whereabouts import Placing

METRICS = ("friction", "take_up", "spring")
FAULT = parse_fault("gear_friction")


def run(random, channels):
    """Return a run in which one reading of some channels is off."""
    found = {("staircase", metric, c.label): float(random.normal(0, 0.3)) for metric in METRICS for c in Channel}
    metric = METRICS[int(random.integers(3))]
    return deviation(found | {("staircase", metric, c.label): random.uniform(8, 90) for c in channels}, {})


def test_one_channel_and_all_of_them_are_told_apart_on_hands_that_it_was_not_taught():
    random = np.random.default_rng(1)
    taught = [(run(random, [c]), Place.ONE_CHANNEL) for c in Channel] * 2
    taught += [(run(random, Channel), Place.SUPPLY) for _ in range(14)]
    weights = fit_places([one for one, _ in taught], [place for _, place in taught])
    placing = Placing({}, weights)
    for channel in Channel:
        assert placing.shares(run(random, [channel]))[Place.ONE_CHANNEL] > 0.8
        assert placing.shares(run(random, Channel))[Place.SUPPLY] > 0.8


def test_what_most_hands_read_is_usual():
    runs = [{("audit", "quantum_fits", "ring"): 10.0, ("audit", "pull", "ring"): 0.1}] * 3
    # asinh(20) - 1, to one place; what is near zero is left out.
    assert usual_readings(runs) == {"audit/quantum_fits": 2.7}


def held_out(own, other):
    return [Likeness("gear_friction", Channel.RING, own, FAULT), Likeness("stuck", Channel.RING, other, FAULT)]


def test_a_kind_whose_hands_explain_each_other_is_believed_and_one_that_others_explain_is_not():
    places = [{Place.ONE_CHANNEL: 1.0}] * 12
    sure = trust([held_out(0.95, 0.1)] * 12, ["gear_friction"] * 12, places)
    assert sure.known(0.95) > 0.9
    assert sure.known(0.1) < 0.1
    assert sure.right[0] > 0.9
    unsure = trust([held_out(0.5, 0.5)] * 12, ["gear_friction"] * 12, places)
    assert unsure.known(0.5) == pytest.approx(0.5, abs=0.01)
    assert unsure.right == (0.5,) * 12


def test_nothing_can_be_trusted_when_no_cause_has_two_hands():
    with pytest.raises(ValueError, match="draw more"):
        trust([[Likeness("stuck", None, 0.5, FAULT)]], ["gear_friction"], [{}])
