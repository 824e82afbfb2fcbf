"""The policy's side of the cube task, defined once for training and for deployment.

The functions work on NumPy arrays and inside a JAX trace alike: they use the array's own namespace and never import
one, so that the graph that is trained and the loop that is deployed cannot drift apart. Channel arrays are in command
order; the observation order exists only inside `observe`.

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
"""What each of the 14 values is; written into policy files and compared when one is loaded."""
ACTION_LAYOUT = tuple(channel.label for channel in Channel)
"""What each of the 7 actions is."""


class ShownAction(Enum):
    """Which action an observation shows; a policy is trained with one of the two and fails with the other."""

    LAST = "last"
    """The action that led to the measured lengths, as the paper writes it."""
    BEFORE_LAST = "before_last"
    """The one before it, as the released environment does: it updates its memory after it observes."""


class ActionMemory(NamedTuple):
    """The two latest actions, each (..., 7) in command order."""

    last: Array
    before_last: Array

    @classmethod
    def empty(cls, like: Array) -> ActionMemory:
        """Return a memory of zero actions, shaped and typed as `like` (..., 7)."""
        return cls(like * 0, like * 0)

    def after(self, action: Array) -> ActionMemory:
        """Return the memory once `action` (..., 7) has been applied."""
        return ActionMemory(action, self.last)

    def shown(self, which: ShownAction) -> Array:
        """Return the action that an observation made now shows, (..., 7)."""
        return self.last if which is ShownAction.LAST else self.before_last


def observe(lengths: Array, shown_action: Array) -> Array:
    """Return the observation.

    Args:
        lengths: measured channel values, (..., 7) in command order, m, abduction rad.
        shown_action: the action it shows, (..., 7) in command order.

    Returns:
        (..., 14): the values in observation order, then the action in command order.
    """
    in_observation_order = lengths[..., np.array(OBSERVATION_ORDER)]
    return namespace(lengths).concatenate([in_observation_order, shown_action], axis=-1)


def furthest_codes(actuation_map: ActuationMap, nominal: Array, scale: Array, correction: Array) -> Array:
    """Return the code that each channel is sent to at most, (7,), by actions in -1..1."""
    ends = np.array([nominal + side * scale + correction for side in (-1, 1)])
    angles = actuation_map.angles_from_travel(actuation_map.travel_from_lengths(ends))
    return actuation_map.saturating_codes(angles).codes.max(axis=0)


def targets(action: Array, nominal: Array, scale: Array) -> Array:
    """Return the actuator targets `nominal + scale * action`, (..., 7) in command order, m, abduction rad.

    They are not clamped: the simulator clamps to the actuator range, the actuation map to the command window.
    """
    return nominal + scale * action
