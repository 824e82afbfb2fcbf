"""Proximal policy optimisation: one control period of acting, one pass of learning. Brax's losses, Optax's Adam.

Brax's own training loop is one compiled program that cannot be interrupted, saved or resumed. This one returns to
Python between the control periods.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any, NamedTuple

import train.quiet_import  # noqa: F401 - before Brax, which imports MJX

# isort: split
import jax
import jax.numpy as jnp
import optax
from brax.training import types
from brax.training.acme import running_statistics, specs
from brax.training.agents.ppo import networks as ppo_networks
from brax.training.agents.ppo.losses import PPONetworkParams, compute_ppo_loss
from brax.training.types import Transition

from aero.actuation.arrays import Array
from aero.policy.file import Policy
from aero.policy.interface import PolicyFileError
from aero.policy.network import Network
from aero.policy.task import ACTION_SIZE, OBSERVATION_SIZE
from train.convert import network
from train.environment import CubeEnvironment, EnvironmentState, Prices
from train.recipe import Ramp, Recipe, TrainingStage
from train.task import CRITIC_SIZE, HAND_FACTS, Task

AVERAGE_DECAY = 0.99
"""Fraction of the moving average of the policy's weights that is kept per update."""
SIZES = {"state": OBSERVATION_SIZE, "privileged_state": CRITIC_SIZE + HAND_FACTS}


NetworkParameters = Any
"""Brax parameters (normaliser, policy, value)."""


class Learner(NamedTuple):
    """State of the learner, a JAX pytree."""

    normaliser: Any
    networks: PPONetworkParams
    average: Any
    """Moving average of the policy's weights."""
    optimiser: Any

    @property
    def parameters(self) -> NetworkParameters:
        """Learned parameters."""
        return self.normaliser, self.networks.policy, self.networks.value

    @property
    def averaged_parameters(self) -> NetworkParameters:
        """Learned parameters with the averaged policy."""
        return self.normaliser, self.average, self.networks.value


def networks_of(recipe: Recipe) -> ppo_networks.PPONetworks:
    """Return the networks of a recipe."""
    return ppo_networks.make_ppo_networks(
        SIZES,
        ACTION_SIZE,
        preprocess_observations_fn=running_statistics.normalize,
        policy_hidden_layer_sizes=recipe.hidden,
        value_hidden_layer_sizes=recipe.hidden,
        value_obs_key="privileged_state",
    )


def untrained(networks: ppo_networks.PPONetworks, key: Array) -> tuple[Any, PPONetworkParams]:
    """Return an empty normaliser and freshly initialised parameters."""
    policy_key, value_key = jax.random.split(key)
    sizes = {name: specs.Array((size,), jnp.dtype("float32")) for name, size in SIZES.items()}
    parameters = PPONetworkParams(networks.policy_network.init(policy_key), networks.value_network.init(value_key))
    return running_statistics.init_state(sizes), parameters


class Ppo:
    """Networks and optimiser of one stage."""

    def __init__(self, recipe: Recipe, stage: TrainingStage, environment: CubeEnvironment) -> None:
        self._recipe, self._stage, self._environment = recipe, stage, environment
        self._networks = networks_of(recipe)
        self._optimiser = optax.multi_transform(
            {
                "policy": self._adam(stage.learning_rate, 0, frozen=stage.frozen_updates),
                "value": self._adam(stage.value_learning_rate, 1),
            },
            PPONetworkParams(policy="policy", value="value"),
        )
        self.act = jax.jit(self._act)
        self.learn = jax.jit(self._learn)

    def begin(self, key: Array) -> Learner:
        """Return an untrained learner."""
        normaliser, networks = untrained(self._networks, key)
        return Learner(normaliser, networks, networks.policy, self._optimiser.init(networks))

    def continued(self, learner: Learner) -> Learner:
        """Return the learner of another stage with fresh optimiser and average for this stage."""
        return learner._replace(average=learner.networks.policy, optimiser=self._optimiser.init(learner.networks))

    def _adam(self, rate: Ramp, which: int, frozen: int = 0) -> optax.GradientTransformation:
        passes = self._recipe.epochs * self._recipe.minibatches
        batch = self._recipe.environments * self._stage.unroll

        def scheduled(count: Array) -> Array:
            updates = count // passes
            share = jnp.minimum(updates * batch / rate.steps, 1.0)
            return jnp.where(updates < frozen, 0.0, rate.first + (rate.last - rate.first) * share)

        adam = optax.adam(scheduled)
        if self._stage.gradient_norm is None:
            return adam
        return optax.chain(optax.clip_by_global_norm(self._stage.gradient_norm[which]), adam)

    def _act(
        self, learner: Learner, standing: EnvironmentState, prices: Prices, key: Array
    ) -> tuple[EnvironmentState, Any]:
        """Act with exploration for one control period in every environment; also return the transition."""
        distribution = self._networks.parametric_action_distribution
        logits = self._networks.policy_network.apply(learner.normaliser, learner.networks.policy, standing.observation)
        raw = distribution.sample_no_postprocessing(logits, key)
        after, step = self._environment.step(standing, distribution.postprocess(raw), prices)
        transition = Transition(
            observation=standing.observation,
            action=raw,
            reward=step.reward,
            discount=1.0 - step.over,
            next_observation=after.observation,
            extras={
                "policy_extras": {
                    "raw_action": raw,
                    "log_prob": distribution.log_prob(logits, raw),
                    "distribution_params": logits,
                },
                "state_extras": {"truncation": step.cut},
            },
        )
        return after, (transition, step.rotation.mean(), step.lost.mean())

    def observe(self, learner: Learner, data: Transition) -> Learner:
        """Update the normaliser's statistics with a batch (environments, steps, ...)."""
        return learner._replace(normaliser=running_statistics.update(learner.normaliser, data.observation))

    def _learn(self, learner: Learner, data: Transition, key: Array, entropy_cost: Array) -> Learner:
        """Train for one pass over a batch (environments, steps, ...)."""
        order_key, key = jax.random.split(key)
        minibatches = self._recipe.minibatches
        order = jax.random.permutation(order_key, self._recipe.environments)
        shuffled = jax.tree.map(lambda x: x[order].reshape(minibatches, -1, *x.shape[1:]), data)
        loss = partial(
            compute_ppo_loss,
            ppo_network=self._networks,
            entropy_cost=entropy_cost,
            discounting=self._stage.discount,
            gae_lambda=self._recipe.gae,
            clipping_epsilon=self._stage.clipping,
        )

        def descend(carry: tuple[Any, Any], batch: tuple[Transition, Array]) -> tuple[tuple[Any, Any], None]:
            networks, optimiser = carry
            gradients, _ = jax.grad(loss, has_aux=True)(networks, learner.normaliser, *batch)
            change, optimiser = self._optimiser.update(gradients, optimiser, networks)
            return (optax.apply_updates(networks, change), optimiser), None

        keys = jax.random.split(key, minibatches)
        (networks, optimiser), _ = jax.lax.scan(descend, (learner.networks, learner.optimiser), (shuffled, keys))
        return learner._replace(networks=networks, optimiser=optimiser)


OBSERVED_STEPS = 20_000
"""Weight of the observation statistics in a policy file, environment steps; those of its training are not kept."""


def fresh_critic(policy: Policy, fresh: Learner) -> Learner:
    """Return the untrained learner `fresh` with the actor of `policy` and its observation statistics.

    Raises:
        PolicyFileError: no network of this project, or another shape.
    """
    own = policy.network
    shapes = jax.tree.map(jnp.shape, fresh.networks.policy["params"])
    if not isinstance(own, Network):
        raise PolicyFileError(f"{policy.name} is not a network of this project")
    layers = {
        f"hidden_{k}": {"kernel": jnp.asarray(layer.kernel), "bias": jnp.asarray(layer.bias)}
        for k, layer in enumerate(own.layers)
    }
    if jax.tree.map(jnp.shape, layers) != shapes:
        raise PolicyFileError(f"{policy.name} does not fit the recipe's networks")
    old = fresh.normaliser
    mean, std = jnp.asarray(own.mean), jnp.asarray(own.std)
    normaliser = old.replace(
        count=types.UInt64(hi=0, lo=OBSERVED_STEPS),
        mean=old.mean | {"state": mean},
        std=old.std | {"state": std},
        summed_variance=old.summed_variance | {"state": OBSERVED_STEPS * std**2},
    )
    actor = {"params": layers}
    return fresh._replace(normaliser=normaliser, networks=fresh.networks.replace(policy=actor), average=actor)


def averaged(learner: Learner) -> Learner:
    """Return the learner after adding its policy to the moving average."""
    average = jax.tree.map(
        lambda old, new: AVERAGE_DECAY * old + (1.0 - AVERAGE_DECAY) * new, learner.average, learner.networks.policy
    )
    return learner._replace(average=average)


def batched(transitions: list[Transition]) -> Transition:
    """Stack the transitions of an unroll to (environments, steps, ...)."""
    return jax.tree.map(lambda *steps: jnp.stack(steps, axis=1), *transitions)


def deployable(name: str, task: Task, parameters: NetworkParameters, provenance: Mapping[str, Any]) -> Policy:
    """Return the deployable part of PPO parameters trained on `task`."""
    normaliser, actor, _ = parameters
    return Policy(
        name=name,
        network=network(normaliser.mean["state"], normaliser.std["state"], actor["params"]),
        settings=task.settings,
        shown_action=task.shown_action,
        provenance=dict(provenance),
    )
