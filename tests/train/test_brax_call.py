"""How Brax is called: the settings that reach it are the paper's (section "Training"), from the recipe `paper`."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("brax.training.agents.ppo", reason="needs the extra `train`")

import jax
import jax.numpy as jnp

from train import ppo, randomise
from train.actuation import IDEAL
from train.environment import CubeEnvironment
from train.recipe import PAPER
from train.task.episode import Task
from train.task.signals import SENSOR_COUNT

SMALL = replace(PAPER, environments=8, minibatches=2)
PAPER_ROWS = {
    "fingertip friction", "cube inertia", "cube centre of mass", "joint zero offsets", "joint dry friction",
    "joint armature", "link masses", "actuator position gain", "joint damping",
}  # fmt: skip
"""Table "dr"."""


class _Asked(Exception):  # noqa: N818 - carries what was asked for, and is no error
    """Brax was called."""


@pytest.fixture
def rows(monkeypatch):
    """Names of the rows of each draw, in turn: of the hands that are trained on, and of those that are measured on."""
    drawn, draw = [], randomise.draw

    def spy(model, rng, environments, rows, cubes=None):
        drawn.append((environments, {row.name for row in rows}))
        return draw(model, rng, environments, rows, cubes)

    monkeypatch.setattr(randomise, "draw", spy)
    return drawn


@pytest.fixture
def asked(rows, monkeypatch, tmp_path):
    """What Brax is asked for by a run of the paper's recipe on eight hands."""

    def fake(**options):
        raise _Asked(options)

    monkeypatch.setattr(ppo.brax_ppo, "train", fake)
    with pytest.raises(_Asked) as caught:
        ppo.train(SMALL, "native", 0, tmp_path, threads=1)
    return caught.value.args[0]


def test_brax_is_asked_for_the_papers_settings(asked):
    expected = {
        "learning_rate": 3e-4,
        "discounting": 0.97,
        "entropy_cost": 1e-2,
        "unroll_length": 40,
        "num_updates_per_batch": 4,
        "normalize_observations": True,
        "clipping_epsilon": 0.3,
        "gae_lambda": 0.95,
        "episode_length": 500,
    }
    assert {name: asked[name] for name in expected} == expected
    assert (asked["num_envs"], asked["num_minibatches"], asked["batch_size"]) == (8, 2, 4)
    # "no gradient clipping", and nothing else that the paper does not speak of.
    assert asked.keys() - expected.keys() == {
        "environment", "max_devices_per_host", "wrap_env", "num_envs", "batch_size", "num_minibatches",
        "network_factory", "seed", "run_evals", "num_timesteps", "num_evals", "policy_params_fn", "restore_params",
    }  # fmt: skip
    assert asked["num_timesteps"] == 10_000_000
    assert asked["restore_params"] is None


def test_networks_have_the_papers_layers_and_swish(asked):
    """ "hidden layers (512, 256, 128) and swish activations"; the value network reads the privileged state."""
    networks = asked["network_factory"]({"state": 14, "privileged_state": 81}, 7)
    actor, critic = (
        jax.eval_shape(network.init, jax.random.PRNGKey(0))["params"]
        for network in (networks.policy_network, networks.value_network)
    )
    widths = lambda layers: [layers[f"hidden_{i}"]["kernel"].shape for i in range(len(layers))]  # noqa: E731
    assert widths(actor) == [(14, 512), (512, 256), (256, 128), (128, 14)]
    assert widths(critic) == [(81, 512), (512, 256), (256, 128), (128, 1)]
    zeros = jax.tree.map(
        lambda leaf: jnp.zeros(leaf.shape), jax.eval_shape(networks.policy_network.init, jax.random.PRNGKey(0))
    )
    for index in range(3):
        zeros["params"][f"hidden_{index}"]["bias"] = jnp.full_like(zeros["params"][f"hidden_{index}"]["bias"], -1.0)
    zeros["params"]["hidden_3"]["kernel"] = jnp.ones((128, 14)) / 128
    swish = -1.0 / (1.0 + np.e)  # of the last hidden layer, whose inputs weigh nothing
    np.testing.assert_allclose(networks.policy_network.apply(None, zeros, jnp.zeros((1, 14))), swish, rtol=1e-5)


def test_the_hands_that_are_trained_on_are_randomised_as_table_dr_and_those_that_judge_are_not(asked, rows):
    assert rows == [(8, PAPER_ROWS), (100, set())]
    task = asked["environment"]._task
    assert (task.episode_steps, task.actuation) == (500, IDEAL)


def test_every_environment_gets_noise_of_its_own_afresh_at_every_step_of_five_millimetres_to_both_sides():
    """Equation (obs); a stand-in for the physics in which nothing moves."""
    hands = 512
    starts = np.zeros((hands, 1, 46)), np.zeros((hands, 1, SENSOR_COUNT))
    environment = CubeEnvironment(
        Task(), lambda states, _: (states, jnp.zeros((hands, 5, SENSOR_COUNT))), starts, "native"
    )
    state = jax.jit(environment.reset)(jax.random.split(jax.random.PRNGKey(0), hands))
    seen = [np.asarray(state.obs["state"])]
    step = jax.jit(environment.step)
    for _ in range(3):
        state = step(state, jnp.zeros((hands, 7)))
        seen.append(np.asarray(state.obs["state"]))
    noise = np.stack(seen)[..., :7] / [*[0.005] * 6, 0.05]
    assert (np.abs(noise) <= 1.0 + 1e-6).all()
    assert noise.min(axis=(0, 1)).max() < -0.99
    assert noise.max(axis=(0, 1)).min() > 0.99
    together = np.corrcoef(noise.transpose(0, 2, 1).reshape(28, hands))
    np.testing.assert_allclose(together, np.eye(28), atol=0.2)
