"""Deployments as data, and what a set of trials says about one."""

from dataclasses import replace

import numpy as np
import pytest
from policies import policy

from aero.policy.settings import PAPER_DEPLOYMENT
from aero.policy.task import ShownAction
from train.evaluation.cube_trial import run_trial
from train.evaluation.trials import ANY_HAND, load_deployments

NODE = load_deployments()["ros2-node"]
CHANGES = {
    "unit": "reference",
    "firmware": "0.2.0",
    "settings": "own",
    "one_period_late": False,
    "shown_action": "before_last",
    "correction": "exact",
}


@pytest.fixture(scope="module")
def commands():
    """Return the codes that a deployment sends in half a second."""

    def sent(deployment):
        (case,) = deployment.cases(policy(3), 1, seconds=0.5, seed=1)
        codes = []
        settings = replace(case.settings, approach_s=0.3, wait_s=0.1)
        run_trial(policy(3), case.spec, settings, on_step=lambda step: codes.append(step.command))
        return np.array(codes)

    return sent


@pytest.fixture(scope="module")
def as_the_node_does(commands):
    return commands(NODE)


def test_the_same_deployment_sends_the_same(commands, as_the_node_does):
    np.testing.assert_array_equal(commands(NODE), as_the_node_does)


@pytest.mark.parametrize("field", CHANGES)
def test_every_row_of_a_deployment_changes_what_is_sent(field, commands, as_the_node_does):
    changed = commands(replace(NODE, **{field: CHANGES[field]}))
    assert changed.shape == as_the_node_does.shape
    assert (changed != as_the_node_does).any()


@pytest.mark.parametrize("name", load_deployments())
def test_every_deployment_can_be_run(name):
    deployment = load_deployments()[name]
    first, second = deployment.cases(policy(), 2, seconds=1.0, seed=5)
    assert (first.spec.unit == second.spec.unit) is (deployment.unit != ANY_HAND)
    assert (first.spec.seed, second.spec.seed) == (5, 6)
    assert any(first.settings.correction) is (deployment.correction != "none")


def test_the_node_runs_as_the_paper_says_and_run_policy_as_the_policy_says():
    """Section "Zero-shot deployment", on the paper's hand; the node `rl_z_rotation_deploy` writes a period late."""
    settings = NODE.run_settings(15.0)
    assert (NODE.unit, NODE.firmware, NODE.correction, NODE.guarded) == ("paper", "pre", "none", False)
    assert settings.settings == PAPER_DEPLOYMENT
    assert (settings.one_period_late, settings.shown_action) == (True, ShownAction.LAST)
    own = load_deployments()["run-policy"].run_settings(15.0)
    assert (own.settings, own.one_period_late, own.shown_action) == (None, False, None)
