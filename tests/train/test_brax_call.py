"""What reaches Brax's loss, its networks and Optax: the paper's settings (section "Training")."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("brax.training.agents.ppo", reason="needs the extra `train`")

import jax
import jax.numpy as jnp
from brax.training.acme import running_statistics

from train import ppo, randomise
from train.actuation import IDEAL
from train.environment import CubeEnvironment
from train.recipe import PAPER
from train.run import updated
from train.run_state import Standing
from train.stage_run import EPISODE_S, Reached, StageRun
from train.task.episode import Task
from train.task.signals import SENSOR_COUNT

SMALL = replace(PAPER, environments=8, minibatches=2)
(STAGE,) = SMALL.stages
KEY = jax.random.PRNGKey(0)
PAPER_ROWS = {
    "fingertip friction", "cube inertia", "cube centre of mass", "joint zero offsets", "joint dry friction",
    "joint armature", "link masses", "actuator position gain", "joint damping",
}  # fmt: skip
"""Table "dr"."""


class _Asked(Exception):  # noqa: N818 - carries what was asked for, and is no error
    """Brax was called."""


@pytest.fixture(scope="module")
def learner():
    """The networks and the optimiser of the paper's recipe, which have learned nothing, on no environment."""
    made = ppo.Ppo(SMALL, STAGE, None)
    return made, made.begin(KEY)


def test_the_loss_is_brax_with_the_papers_settings(learner, monkeypatch):
    """ "a discount factor of 0.97", "a clipping parameter of 0.3, a generalised advantage estimation factor 0.95"."""

    def fake(*_, ppo_network, **options):
        raise _Asked(options)

    monkeypatch.setattr(ppo, "compute_ppo_loss", fake)
    made, standing = learner
    with pytest.raises(_Asked) as caught:
        made._learn(standing, jnp.zeros((8, 40)), KEY, 0.01)
    # Nothing that the paper does not speak of: rewards and advantages are scaled as Brax does.
    assert caught.value.args[0] == {
        "entropy_cost": 0.01,
        "discounting": 0.97,
        "gae_lambda": 0.95,
        "clipping_epsilon": 0.3,
    }


def test_an_update_is_an_unroll_of_40_one_look_at_the_observations_and_four_passes_at_an_entropy_cost_of_a_hundredth():
    """And the prices of equation (reward); each key is its own."""
    calls, keys = [], []

    class Learner:
        epochs = SMALL.epochs

        def act(self, learner, environment, prices, key):
            calls.append(("act", float(prices.fall), float(prices.action_rate)))
            keys.append(tuple(np.asarray(key).tolist()))
            return environment, (jnp.zeros(1), 0.5, 0.0)

        def observe(self, learner, data):
            calls.append(("observe", data.shape))
            return learner

        def learn(self, learner, data, key, entropy_cost):
            calls.append(("learn", round(float(entropy_cost), 9)))
            keys.append(tuple(np.asarray(key).tolist()))
            return learner

    prepared = SimpleNamespace(stage=STAGE, ppo=Learner(), key=KEY, batch=8 * STAGE.unroll, period_s=0.05)
    averages = SimpleNamespace(policy=jnp.zeros(1))
    state = SimpleNamespace(average=jnp.zeros(1), networks=averages, _replace=lambda **_: None)
    standing, _ = updated(prepared, Standing("paper", 0), Reached(state, None), lambda: None)
    assert calls == [("act", -100.0, -1.0)] * 40 + [("observe", (1, 40))] + [("learn", 0.01)] * 4
    assert len(set(keys)) == 44
    assert (standing.steps, standing.updates) == (320, 1)


def test_adam_steps_by_the_papers_rate_in_both_networks_and_clips_no_gradient(learner):
    """ "a learning rate of 3e-4", "no gradient clipping": Adam's first step is the rate, whatever the gradient."""
    made, standing = learner
    assert STAGE.gradient_norm is None
    ones = jax.tree.map(jnp.ones_like, standing.networks)
    change, state = made._optimiser.update(ones, standing.optimiser, standing.networks)
    for leaf in jax.tree.leaves(change):
        np.testing.assert_allclose(leaf, -3e-4, rtol=1e-4)
    # The second step tells a gradient ten times as large from one that was clipped to the first.
    change, _ = made._optimiser.update(jax.tree.map(lambda one: 10 * one, ones), state, standing.networks)
    mean, square = (0.9 * 0.1 + 0.1 * 10) / (1 - 0.9**2), (0.999 * 1e-3 + 1e-3 * 100) / (1 - 0.999**2)
    for leaf in jax.tree.leaves(change):
        np.testing.assert_allclose(leaf, -3e-4 * mean / np.sqrt(square), rtol=1e-3)


def test_networks_have_the_papers_layers_and_swish_and_see_observations_normalised(learner):
    """ "hidden layers (512, 256, 128) and swish activations", "Observation normalisation is enabled"."""
    made, standing = learner
    actor, critic = (network["params"] for network in (standing.networks.policy, standing.networks.value))

    def widths(layers):
        return [layers[f"hidden_{i}"]["kernel"].shape for i in range(len(layers))]

    assert widths(actor) == [(14, 512), (512, 256), (256, 128), (128, 14)]
    assert widths(critic) == [(81, 512), (512, 256), (256, 128), (128, 1)]

    bare = jax.tree.map(jnp.zeros_like, standing.networks.policy)
    for index in range(3):
        bare["params"][f"hidden_{index}"]["bias"] = -jnp.ones_like(bare["params"][f"hidden_{index}"]["bias"])
    bare["params"]["hidden_3"]["kernel"] = jnp.ones((128, 14)) / 128
    apply, seen = (
        made._networks.policy_network.apply,
        {"state": jnp.zeros((1, 14)), "privileged_state": jnp.zeros((1, 81))},
    )
    np.testing.assert_allclose(apply(standing.normaliser, bare, seen), -1.0 / (1.0 + np.e), rtol=1e-5)

    batch = {name: 5.0 + 2.0 * jax.random.normal(KEY, (8, 40, size)) for name, size in ppo.SIZES.items()}
    after = made.observe(standing, SimpleNamespace(observation=batch))
    for name, values in batch.items():
        np.testing.assert_allclose(after.normaliser.mean[name], values.mean(axis=(0, 1)), rtol=1e-4)
        np.testing.assert_allclose(after.normaliser.std[name], values.std(axis=(0, 1)), rtol=1e-3)
    moved = {name: after.normaliser.mean[name] + after.normaliser.std[name] for name in batch}
    one = {name: jnp.ones((size,)) for name, size in ppo.SIZES.items()}
    networks = made._networks
    for network, weights in (
        (networks.policy_network, standing.networks.policy),
        (networks.value_network, standing.networks.value),
    ):
        plain = running_statistics.init_state({name: jnp.zeros(size) for name, size in ppo.SIZES.items()})
        np.testing.assert_allclose(
            network.apply(after.normaliser, weights, moved), network.apply(plain, weights, one), rtol=1e-3, atol=1e-4
        )


def test_the_hands_that_are_trained_on_are_randomised_as_table_dr_and_those_that_judge_are_not(monkeypatch):
    """A checkpoint is judged on 100 of them over 15 s, the paper's episodes of section "Behaviour in simulation"."""
    drawn, draw = [], randomise.draw

    def spy(model, rng, environments, rows, cubes=None):
        drawn.append((environments, {row.name for row in rows}, cubes))
        return draw(model, rng, environments, rows, cubes)

    monkeypatch.setattr(randomise, "draw", spy)
    with StageRun(SMALL, STAGE, "native", (0,), threads=1, check=lambda: None) as prepared:
        task = prepared.environment._task
    assert drawn == [(8, PAPER_ROWS, None), (100, set(), None)]
    assert (task.episode_steps, task.actuation) == (500, IDEAL)
    assert pytest.approx(15.0) == EPISODE_S


def test_every_environment_gets_noise_of_its_own_afresh_at_every_step_of_five_millimetres_to_both_sides():
    """Equation (obs); a stand-in for the physics in which nothing moves."""
    hands = 512
    starts = np.zeros((hands, 1, 46)), np.zeros((hands, 1, SENSOR_COUNT))
    environment = CubeEnvironment(Task(), lambda states, _: (states, jnp.zeros((hands, 5, SENSOR_COUNT))))
    standing = jax.jit(environment.begin)(starts, KEY)
    seen = [np.asarray(standing.observation["state"])]
    step = jax.jit(environment.step)
    for _ in range(3):
        standing, _ = step(standing, jnp.zeros((hands, 7)), environment.prices)
        seen.append(np.asarray(standing.observation["state"]))
    noise = np.stack(seen)[..., :7] / [*[0.005] * 6, 0.05]
    assert (np.abs(noise) <= 1.0 + 1e-6).all()
    assert noise.min(axis=(0, 1)).max() < -0.99
    assert noise.max(axis=(0, 1)).min() > 0.99
    together = np.corrcoef(noise.transpose(0, 2, 1).reshape(28, hands))
    np.testing.assert_allclose(together, np.eye(28), atol=0.2)
