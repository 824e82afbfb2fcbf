"""Random policies."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from aero import ActuationMap
from aero.policy.file import Policy
from aero.policy.interface import History
from aero.policy.network import Layer, Network
from aero.policy.settings import PAPER_TRAINING
from aero.policy.task import ShownAction

WIDTHS = (14, 16, 8, 14)


def network(seed: int = 0, widths: tuple[int, ...] = WIDTHS) -> Network:
    rng = np.random.default_rng(seed)
    layers = tuple(
        Layer(
            rng.normal(0, 1 / np.sqrt(inputs), (inputs, outputs)).astype(np.float32),
            rng.normal(0, 0.1, outputs).astype(np.float32),
        )
        for inputs, outputs in pairwise(widths)
    )
    nominal = np.array(PAPER_TRAINING.nominal)[[0, 1, 2, 3, 5, 6, 4]]
    mean = np.concatenate([nominal, rng.uniform(-0.5, 0.5, 7)]).astype(np.float32)
    std = np.concatenate([np.full(6, 0.005), [0.17], np.full(7, 0.24)]).astype(np.float32)
    return Network(mean, std, layers)


def policy(seed: int = 0, shown_action: ShownAction = ShownAction.LAST) -> Policy:
    return Policy("test", network(seed), PAPER_TRAINING, shown_action, provenance={"seed": seed})


def holding() -> Policy:
    """Return a policy with zero actions, which keeps the nominal grasp."""
    net = policy().network
    *hidden, last = net.layers
    still = Layer(np.zeros_like(last.kernel), np.zeros_like(last.bias))
    return replace(policy(), network=replace(net, layers=(*hidden, still)))


def actions_on(policy, lengths, currents=None):
    """Return the actions of `policy` (steps, 7) for the sequence of `lengths` (steps, 7).

    Args:
        policy: what acts.
        lengths: as it reads them, m, abduction rad.
        currents: (steps, 7) after each action, A; of interest to a policy that observes them.
    """
    interface = policy.interface
    history, actions = History(interface, ActuationMap()), []
    for k, row in enumerate(lengths):
        action = interface.action.bounded(policy.network.act(history.observe(row)).astype(np.float64))
        history.acted(action)
        if currents is not None:
            history.drew(currents[k])
        actions.append(action)
    return np.array(actions)


@dataclass
class Played:
    """Returns the rows of a script in sequence, regardless of the observation."""

    script: np.ndarray

    def __post_init__(self):
        self._rows = iter(self.script)

    def act(self, _observation):
        return next(self._rows)


def playing(script, of: Policy | None = None) -> Policy:
    """Return a policy that plays a script (periods, 7) open loop, with the settings of another policy."""
    return replace(of or policy(), network=Played(script))
