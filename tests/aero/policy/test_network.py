import numpy as np
import pytest
from hypothesis import given
from policies import network
from policy_strategies import finite_observations, seeds

from aero.policy.network import Network

OBSERVATION = network().mean + network().std * np.linspace(-2, 2, 14, dtype=np.float32)


@given(seeds, finite_observations)
def test_actions_are_finite_and_inside_the_open_interval_for_any_finite_observation(seed, observation):
    action = network(seed).act(observation)
    assert action.shape == (7,)
    assert np.isfinite(action).all()
    assert (np.abs(action) < 1).all()


@given(seeds)
def test_the_network_is_what_its_formula_says(seed):
    net = network(seed)
    x = (OBSERVATION.astype(np.float64) - net.mean) / net.std
    for layer in net.layers[:-1]:
        x = x @ layer.kernel + layer.bias
        x = x / (1 + np.exp(-x))
    x = x @ net.layers[-1].kernel + net.layers[-1].bias
    np.testing.assert_allclose(net.act(OBSERVATION), np.tanh(x[:7]), atol=1e-5)


@given(seeds)
def test_a_batch_gives_what_each_observation_gives(seed):
    net = network(seed)
    batch = np.random.default_rng(seed).normal(size=(3, 2, 14)) * net.std + net.mean
    np.testing.assert_allclose(net.act(batch)[1, 1], net.act(batch[1, 1]), atol=1e-6)


def test_weights_are_copies_that_cannot_be_written_to():
    mine = network().mean.copy()
    net = Network(mine, network().std, network().layers)
    before = net.act(OBSERVATION)
    mine += 1.0
    np.testing.assert_array_equal(net.act(OBSERVATION), before)
    for array in (net.mean, net.std, *(part for layer in net.layers for part in (layer.kernel, layer.bias))):
        with pytest.raises(ValueError, match="read-only"):
            array[:] = 1.0
