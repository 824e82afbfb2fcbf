"""Built hands of the training are corrected as a hand is before it runs a policy."""

from dataclasses import replace

import numpy as np
import pytest

from aero.channels import CABLES, Channel
from aero.policy.settings import PAPER_TRAINING
from model.units import load_unit
from model.units.cable_correction import correction
from model.units.plausible import plausible_unit
from train.built import BuiltSimulator, build_scene
from train.hands import HANDS, draw_hand, training_correction
from train.task import PAPER_RESET, draw_starts, unpack

SETTINGS = replace(PAPER_TRAINING, torque_limit=0.5)


@pytest.fixture(scope="module")
def hands():
    rng = np.random.default_rng(0)
    return [draw_hand(HANDS, rng) for _ in range(16)]


def corrections(hands):
    return np.array([training_correction(unit, SETTINGS) for unit in hands])


@pytest.fixture(scope="module")
def corrected(hands):
    return corrections(hands)


@pytest.mark.parametrize("unit", [load_unit("reference"), plausible_unit(0)])
def test_training_corrects_a_hand_as_deployment_does(unit):
    np.testing.assert_allclose(corrections([unit])[0], correction(unit, SETTINGS), atol=0.2e-3)


def test_hands_differ_by_millimetres_before(corrected):
    cables = corrected[:, CABLES]
    assert (cables.std(axis=0) > 0.5e-3).all()
    assert np.abs(cables).max() > 2e-3


def test_a_policy_commands_and_sees_the_lengths_that_it_knows(hands, corrected):
    starts = draw_starts(np.random.default_rng(0), len(hands), PAPER_RESET)
    scenes = [build_scene(unit, SETTINGS.torque_limit) for unit in hands]
    nominal = np.broadcast_to(np.array(SETTINGS.nominal), (len(hands), 20, len(Channel)))
    with BuiltSimulator(scenes, corrected, threads=1) as batch:
        states, sensors = batch.advance(batch.at(starts), nominal)
    with BuiltSimulator(scenes, threads=1) as batch:
        bare_states, bare = batch.advance(batch.at(starts), nominal + corrected[:, None])
    np.testing.assert_array_equal(states, bare_states)
    np.testing.assert_allclose(unpack(sensors).lengths, unpack(bare).lengths - corrected[:, None], atol=1e-15)
