"""Observation and action of the cube task, shared by training and deployment.

The functions accept NumPy arrays and JAX tracers: they use the array's own namespace, so that training and deployment
run the same code. Channel arrays are in command order; only `observe` uses the observation order.

Sources: paper eqs. (obs) and (action); the released environment `AeroCubeRotateZAxis` (which action is shown).
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

import numpy as np

from aero.actuation.arrays import Array, namespace
from aero.actuation.map import ActuationMap
from aero.channels import OBSERVATION_ORDER, Channel

CHANNELS = len(Channel)
OBSERVATION_SIZE = 2 * CHANNELS
ACTION_SIZE = CHANNELS

OBSERVATION_LAYOUT = tuple(
    [f"length:{channel.label}" for channel in OBSERVATION_ORDER] + [f"action:{channel.label}" for channel in Channel]
)
"""Names of the 14 observed values; stored in policy files and compared on loading."""
ACTION_LAYOUT = tuple(channel.label for channel in Channel)
"""Names of the 7 actions; stored in policy files and compared on loading."""


class ShownAction(Enum):
    """Past action in an observation; a policy trained with one choice fails with the other."""

    LAST = "last"
    """Action that led to the measured lengths, as in the paper."""
    BEFORE_LAST = "before_last"
    """Action before the last, as in the released environment, which updates its memory after the observation."""


class ActionMemory(NamedTuple):
    """Two latest actions, each (..., 7) in command order."""

    last: Array
    before_last: Array

    @classmethod
    def empty(cls, like: Array) -> ActionMemory:
        """Return a memory of zero actions with shape and type of `like` (..., 7)."""
        return cls(like * 0, like * 0)

    def after(self, action: Array) -> ActionMemory:
        """Return the memory after `action` (..., 7)."""
        return ActionMemory(action, self.last)

    def shown(self, which: ShownAction) -> Array:
        """Return the action for the next observation, (..., 7)."""
        return self.last if which is ShownAction.LAST else self.before_last


def observe(lengths: Array, shown_action: Array) -> Array:
    """Return the observation.

    Args:
        lengths: measured channel values, (..., 7) in command order, m, abduction rad.
        shown_action: past action, (..., 7) in command order.

    Returns:
        (..., 14): lengths in observation order, then the action in command order.
    """
    in_observation_order = lengths[..., np.array(OBSERVATION_ORDER)]
    return namespace(lengths).concatenate([in_observation_order, shown_action], axis=-1)


def furthest_codes(actuation_map: ActuationMap, nominal: Array, scale: Array, correction: Array) -> Array:
    """Return the largest code of each channel, (7,), over actions in -1..1."""
    ends = np.array([nominal + side * scale + correction for side in (-1, 1)])
    angles = actuation_map.angles_from_travel(actuation_map.travel_from_lengths(ends))
    return actuation_map.saturating_codes(angles).codes.max(axis=0)


def targets(action: Array, nominal: Array, scale: Array) -> Array:
    """Return the actuator targets `nominal + scale * action`, (..., 7) in command order, m, abduction rad.

    The targets are not clipped: the simulator clips to the actuator range, the actuation map to the command window.
    """
    return nominal + scale * action
