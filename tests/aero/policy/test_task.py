import numpy as np
from hypothesis import given
from policy_strategies import actions, lengths

from aero.policy.settings import PAPER_TRAINING
from aero.policy.task import ActionMemory, ShownAction, observe, targets


@given(lengths, actions)
def test_an_observation_is_four_fingers_cmc_flexor_abduction_and_the_action_in_command_order(values, action):
    index, middle, ring, pinky, abduction, cmc, flexor = values
    expected = [index, middle, ring, pinky, cmc, flexor, abduction, *action]
    np.testing.assert_array_equal(observe(values, action), expected)


@given(actions, actions)
def test_the_memory_shows_the_action_that_was_declared(first, second):
    memory = ActionMemory.empty(first).after(first).after(second)
    np.testing.assert_array_equal(memory.shown(ShownAction.LAST), second)
    np.testing.assert_array_equal(memory.shown(ShownAction.BEFORE_LAST), first)


def test_targets_span_nominal_plus_minus_scale():
    nominal, scale = np.array(PAPER_TRAINING.nominal), np.array(PAPER_TRAINING.scale)
    np.testing.assert_allclose(targets(np.ones(7), nominal, scale), [0.11, 0.11, 0.11, 0.11, 1.45, 0.038, 0.112])
    np.testing.assert_allclose(targets(-np.ones(7), nominal, scale), [0.07, 0.07, 0.07, 0.07, 0.05, 0.032, 0.088])
