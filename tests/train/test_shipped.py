"""The shipped policy: it turns any cube on a hand, and every common mistake in running it shows."""

from dataclasses import replace

import numpy as np
import pytest
from policies import actions_on

from aero.policy.file import Policy
from aero.policy.network import Layer, Network
from aero.policy.running import RunSettings
from aero.policy.shipped import DEFAULT, find_policy
from aero.policy.task import ShownAction
from hil.emulated.emulated_spec import EmulatedSpec
from model.units.cable_correction import correction
from model.units.plausible import plausible_unit, unit_named
from simulator.scene import CUBE, Cube
from train.actuation import BUS
from train.built import BuiltSimulator, build_scene
from train.evaluation.cube_trial import run_trial
from train.evaluation.rollouts import Episodes, run, task_of
from train.hands import training_correction
from train.recipe import AS_PLACED

EPISODES = 8
SECONDS = 5.0


@pytest.fixture(scope="module")
def batch():
    """Healthy hands with the paper's cube, corrected exactly."""
    units, settings = [plausible_unit(k) for k in range(EPISODES)], find_policy(DEFAULT).settings
    scenes = [build_scene(unit, settings.torque_limit) for unit in units]
    corrections = np.array([training_correction(unit, settings) for unit in units])
    with BuiltSimulator(scenes, corrections) as simulator:
        yield simulator


def play(policy: Policy, batch: BuiltSimulator) -> Episodes:
    return run(policy, replace(task_of(policy), actuation=BUS, reset=AS_PLACED), batch, SECONDS, seed=5)


@pytest.fixture(scope="module")
def shipped(batch):
    """Episodes of the shipped policy as it is."""
    return play(find_policy(DEFAULT), batch)


def rate(episodes: Episodes) -> float:
    """Mean rate of the episodes, rad/s, none for one that loses its cube."""
    return float(np.mean(episodes.rate_rad_s * episodes.kept))


def reading(policy: Policy, order: list[int]) -> Policy:
    """Let the network read its observation in another order."""
    network = policy.network
    first = network.layers[0]
    layers = (Layer(first.kernel[order], first.bias), *network.layers[1:])
    return replace(policy, network=Network(network.mean[order], network.std[order], layers))


def acting(policy: Policy, order: list[int]) -> Policy:
    """Let the network's actions go to other channels."""
    network = policy.network
    last = network.layers[-1]
    both = [*order, *(7 + k for k in order)]
    return replace(
        policy,
        network=Network(
            network.mean, network.std, (*network.layers[:-1], Layer(last.kernel[:, both], last.bias[both]))
        ),
    )


COMMAND_AS_WIRE = [4, 5, 6, 0, 1, 2, 3]
MISTAKES = {
    "actions sent in the wire's order": lambda policy: acting(policy, COMMAND_AS_WIRE),
    "lengths read in the wire's order": lambda policy: reading(policy, [6, 4, 5, 0, 1, 2, 3, *range(7, 14)]),
    "normaliser dropped": lambda policy: replace(
        policy, network=Network(np.zeros(14, np.float32), np.ones(14, np.float32), policy.network.layers)
    ),
}


def test_it_turns_the_cube_in_process(shipped):
    assert rate(shipped) > 0.4


@pytest.mark.parametrize(
    ("unit", "side", "cube"),
    [("reference", "right", Cube()), ("plausible:3", "left", Cube(side_m=0.053, mass_kg=0.1, friction=0.7))],
)
def test_it_turns_a_cube_on_the_hand_it_is_made_for(unit, side, cube):
    policy, hand = find_policy(DEFAULT), unit_named(unit)
    settings = RunSettings(seconds=SECONDS, correction=tuple(correction(hand, policy.settings).tolist()))
    trial = run_trial(policy, EmulatedSpec(unit=unit, side=side, guarded=True, cube=cube), settings)
    assert trial.kept
    assert trial.rate_rad_s > 0.4  # on silicone pads: 0.62 rad/s on average of 60 hands, seed 992000


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_in_running_it_shows(mistake, batch, shipped):
    assert rate(play(MISTAKES[mistake](find_policy(DEFAULT)), batch)) < 0.6 * rate(shipped)


def test_showing_another_action_shows_in_a_replay():
    """A gait may survive this mistake, so it is searched for where nothing can hide it."""
    policy, steps = find_policy(DEFAULT), []
    run_trial(
        policy, EmulatedSpec(unit="paper", guarded=True, cube=CUBE), RunSettings(seconds=2.0), on_step=steps.append
    )
    lengths, actions = (np.array([getattr(step, name) for step in steps]) for name in ("lengths", "action"))
    np.testing.assert_array_equal(actions_on(policy, lengths), actions)
    shifted = actions_on(replace(policy, shown_action=ShownAction.BEFORE_LAST), lengths)
    assert np.abs(shifted - actions).mean() > 0.05
