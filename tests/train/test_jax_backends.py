"""What needs JAX: the graphs that are trained against the code that is deployed, and the two backends."""

import pickle
from functools import partial

import numpy as np
import pytest

jax = pytest.importorskip("jax", reason="needs the extra `train`")
brax_networks = pytest.importorskip("brax.training.agents.ppo.networks", reason="needs the extra `train`")

import jax.numpy as jnp  # noqa: E402
from brax.training.acme import running_statistics, specs  # noqa: E402
from brax.training.agents.ppo import checkpoint as brax_checkpoint  # noqa: E402

from aero.policy.settings import PAPER_TRAINING  # noqa: E402
from aero.policy.task import ActionMemory, ShownAction, observe, targets  # noqa: E402
from train import actuation, randomise  # noqa: E402
from train.convert import convert  # noqa: E402
from train.environment import CubeEnvironment, Prices, native, over_mjx, prepare_starts  # noqa: E402
from train.ppo import deployable  # noqa: E402
from train.simulator import Simulator, build_scene, positions  # noqa: E402
from train.task import (  # noqa: E402  # noqa: E402  # noqa: E402
    CRITIC_SIZE,
    HAND_FACTS,
    PAPER_RESET,
    SENSOR_COUNT,
    RewardSettings,
    Task,
    TurningWeight,
    Weights,
    begin,
    command,
    draw_starts,
    finish,
)

NOMINAL = np.array(PAPER_TRAINING.nominal)
HAND_TASK = Task(actuation=actuation.SERVOS, rewarded=RewardSettings(Weights(pushed=-1.0)))


def brax_parameters(seed=0):
    sizes = {"state": 14, "privileged_state": 81}
    networks = brax_networks.make_ppo_networks(
        sizes,
        7,
        preprocess_observations_fn=running_statistics.normalize,
        policy_hidden_layer_sizes=(512, 256, 128),
        value_hidden_layer_sizes=(512, 256, 128),
        value_obs_key="privileged_state",
    )
    keys = jax.random.split(jax.random.PRNGKey(seed), 3)
    statistics = running_statistics.init_state({k: specs.Array((n,), jnp.dtype("float32")) for k, n in sizes.items()})
    batch = {
        "state": 0.09 + 0.01 * jax.random.normal(keys[0], (64, 14)),
        "privileged_state": jax.random.normal(keys[0], (64, 81)),
    }
    statistics = running_statistics.update(statistics, batch)
    return networks, (statistics, networks.policy_network.init(keys[1]), networks.value_network.init(keys[2]))


def brax_actions(networks, parameters, observations):
    act = brax_networks.make_inference_fn(networks)(parameters, deterministic=True)
    full = {"state": jnp.asarray(observations, jnp.float32), "privileged_state": jnp.zeros((len(observations), 81))}
    return np.asarray(jax.jit(act)(full, jax.random.PRNGKey(0))[0])


def test_the_numpy_policy_is_the_brax_policy_on_4096_observations():
    networks, parameters = brax_parameters()
    policy = deployable("test", Task(), parameters, {})
    rng = np.random.default_rng(0)
    observations = policy.network.mean + 3 * policy.network.std * rng.normal(size=(4096, 14))
    expected = brax_actions(networks, parameters, observations)
    assert np.abs(expected).max() > 0.5
    np.testing.assert_allclose(policy.network.act(observations), expected, atol=1e-5)


def pickled(path, parameters):
    path.write_bytes(pickle.dumps(parameters))
    return path


def written_by_brax(path, parameters):
    """Write the folder that Brax and Playground write today."""
    factory = partial(brax_networks.make_ppo_networks, activation=jax.nn.swish, value_obs_key="privileged_state")
    config = brax_checkpoint.network_config({"state": 14, "privileged_state": 81}, 7, True, factory)
    brax_checkpoint.save(path, 1000, parameters, config)
    return path / "000000001000"


@pytest.mark.parametrize("write", [pickled, written_by_brax])
def test_parameters_of_brax_convert_to_the_same_policy(write, tmp_path):
    networks, parameters = brax_parameters(1)
    path = write(tmp_path / "params", parameters)
    policy = convert(path, PAPER_TRAINING)
    observations = policy.network.mean + policy.network.std * np.random.default_rng(0).normal(size=(64, 14))
    expected = brax_actions(networks, parameters, observations)
    np.testing.assert_allclose(policy.network.act(observations), expected, atol=1e-5)
    assert policy.provenance["source"] == path.name


def test_observation_and_action_are_the_same_in_a_trace_and_in_numpy():
    rng = np.random.default_rng(0)
    for shown in ShownAction:
        lengths, a, b = rng.normal(size=(3, 1000, 7)).astype(np.float32)

        def graph(lengths, a, b, shown=shown):
            memory = ActionMemory.empty(a).after(a).after(b)
            return observe(lengths, memory.shown(shown)), targets(b, NOMINAL, np.array(PAPER_TRAINING.scale))

        for traced, plain in zip(jax.jit(graph)(lengths, a, b), graph(lengths, a, b), strict=True):
            np.testing.assert_allclose(traced, plain, atol=1e-6)


def test_an_episode_is_the_same_in_a_trace_and_in_numpy():
    rng = np.random.default_rng(0)
    batch = 8
    start, sensors = rng.normal(size=(batch, SENSOR_COUNT)) * 0.01, rng.normal(size=(batch, 5, SENSOR_COUNT)) * 0.01
    sensors[:, :, 6] += np.arange(batch)[:, None] % 2 * 2.0  # every other thumb is pushed away
    uniform, action = rng.uniform(size=(batch, actuation.DRAWS)), rng.uniform(-1, 1, (batch, 7))
    q, v, noise = rng.normal(size=(batch, 23)), rng.normal(size=(batch, 22)), rng.uniform(-1, 1, (batch, 7))

    def graph(start, uniform, action, period):
        sensors, q, v, noise = period
        episode, controls = command(HAND_TASK, begin(HAND_TASK, start, uniform), action)
        _, outcome = finish(HAND_TASK, episode, sensors, positions=q, velocities=v, noise=noise)
        return controls, outcome.observation, outcome.critic, outcome.reward, outcome.lost

    arguments = (start, uniform, action, (sensors, q, v, noise))
    single = jax.tree.map(lambda array: np.asarray(array, np.float32), arguments)
    count = np.zeros(14)
    count[:7] = actuation.COUNT[[0, 1, 2, 3, 5, 6, 4]] + 1e-6  # rounding may tip a reading over to the next count
    controls, observation, critic, rewarded, lost = jax.jit(graph)(*single)
    expected = graph(*arguments)
    np.testing.assert_allclose(controls, expected[0], atol=1e-6)
    assert (np.abs(observation - expected[1]) <= count + 1e-6).all()
    np.testing.assert_allclose(critic[:, 14:], expected[2][:, 14:], rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(rewarded, expected[3], rtol=1e-5, atol=1e-5)
    np.testing.assert_array_equal(lost, expected[4])


@pytest.fixture(scope="module")
def world():
    """Four routed hands that end their episodes after six steps: the task, its physics and its starts."""
    model = build_scene().compile()
    rng = np.random.default_rng(0)
    simulator = Simulator(randomise.models(model, randomise.draw(model, rng, 4, randomise.table(model))), threads=1)
    task = Task(episode_steps=6, actuation=actuation.SERVOS)
    with simulator:
        yield task, native(simulator), prepare_starts(task, simulator, rng, count=2)


KEY = jax.random.PRNGKey(0)
PUSH = jnp.full((4, 7), 0.1)
PRICES = Prices(np.float32(-100.0), np.float32(-1.0))


def test_the_environment_restarts_by_itself_and_counts_cut_episodes(world):
    task, advance, starts = world
    environment = CubeEnvironment(task, advance)
    state, step = environment.begin(starts, KEY), jax.jit(environment.step)
    for k in range(1, 14):
        state, made = step(state, PUSH, PRICES)
        np.testing.assert_array_equal(made.over, float(k % 6 == 0))
        np.testing.assert_array_equal(made.cut, float(k % 6 == 0))
        shown = np.asarray(state.observation["state"])[:, 7:]
        np.testing.assert_allclose(shown, 0.0 if k % 6 == 0 else 0.1, atol=1e-6)
    shapes = {name: value.shape for name, value in state.observation.items()}
    assert shapes == {"state": (4, 14), "privileged_state": (4, CRITIC_SIZE + HAND_FACTS)}
    assert np.isfinite(np.asarray(state.observation["privileged_state"])).all()


def test_half_of_the_episodes_can_go_on_from_a_running_one(world, monkeypatch):
    """Every state is kept from age 2 on; episodes end after six steps, so that ages exceed six only by going on."""
    monkeypatch.setattr("train.environment.RUNNING_STEPS", (2, 100))
    monkeypatch.setattr("train.environment.KEPT_EVERY", 1)
    task, advance, starts = world
    ages = {}
    for share in (0.0, 1.0):
        environment = CubeEnvironment(task, advance, from_running=share)
        state, step = environment.begin(starts, KEY), jax.jit(environment.step)
        for _ in range(13):
            state, _ = step(state, 0 * PUSH, PRICES)
            assert np.isfinite(np.asarray(state.states)).all()
        ages[share] = np.asarray(state.age)
        assert (np.asarray(state.episode.periods) <= 6).all()
    assert (ages[0.0] == 1).all()
    assert (ages[1.0] > 6).all()
    renewed = environment.renew(state, jnp.array([2]), jax.tree.map(lambda rows: rows[2:3], starts))
    assert (np.asarray(renewed.age) == 0).tolist() == [False, False, True, False]
    assert float(renewed.kept[3][2]) == 0.0


def test_turning_is_weighted_by_the_running_rate_of_each_hand_which_outlives_its_episodes(world):
    task, advance, starts = world
    environment = CubeEnvironment(task, advance, TurningWeight(memory_steps=4))
    state = environment.begin(starts, KEY)._replace(rate=jnp.array([0.0, 0.4, 0.7, 2.0]))
    after, made = environment.step(state, 0 * PUSH, PRICES)
    rotation = np.asarray(made.rotation)
    weights = np.array([2.0, 1.0, 0.5 * 0.6 / 0.9, 0.1 * 0.4])
    np.testing.assert_allclose(made.reward, 0.05 * weights * rotation, atol=1e-6)
    rate = np.asarray(state.rate) + (rotation - np.asarray(state.rate)) / 4
    np.testing.assert_allclose(after.rate, rate, atol=1e-6)
    for _ in range(6):
        before, (after, _) = after, environment.step(after, 0 * PUSH, PRICES)
    assert np.abs(np.asarray(after.rate) - np.asarray(before.rate)).max() < 1.0
    assert (np.asarray(after.rate) != 0.0).all()


@pytest.mark.slow
def test_mjx_and_native_physics_agree_over_a_second():
    model = build_scene().compile()
    rng = np.random.default_rng(3)
    count = 4
    controls = NOMINAL + 0.2 * np.array(PAPER_TRAINING.scale) * rng.uniform(-1, 1, (20, count, 1, 7))
    grasped = draw_starts(rng, count, PAPER_RESET)
    aside = grasped + np.eye(23)[16]  # the cube falls a metre away
    mjx_advance = jax.jit(over_mjx(model))
    with Simulator([model] * count, threads=1) as simulator:

        def mjx(states, controls):
            return mjx_advance(jnp.asarray(states, jnp.float32), jnp.asarray(controls, jnp.float32))

        def gap(starts):
            ends = []
            for advance in (simulator.advance, mjx):
                state = simulator.at(starts)
                for control in controls:
                    state, _ = advance(state, np.repeat(control, 5, axis=1))
                ends.append(positions(state))
            return np.abs(ends[0] - ends[1])

        without_contact, with_contact = gap(aside), gap(grasped)
    assert without_contact[:, :16].max() < 2e-3
    assert without_contact[:, 16:19].max() < 1e-4
    # Contacts amplify what single precision and a cold solver leave open.
    assert with_contact[:, :16].max() < 0.1
    assert with_contact[:, 16:19].max() < 0.03
