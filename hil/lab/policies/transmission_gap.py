"""Where a policy's gap between simulator and hand comes from: the transmission, or the feedback through it.

The actions of a simulated episode are replayed open loop on the hand. Where the hand then moves as the simulator did,
the transmission is good and what remains different in closed loop comes from the policy's feedback (paper section
"Separating transmission mismatch from policy feedback").
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel

Floats = NDArray[np.float64]
Cause = Literal["none", "transmission", "feedback"]

RESIDUAL_SHARE = 0.5
"""Open-loop residual over the simulated motion from which the transmission is to blame."""
MOTION_SHARE = 0.5
"""Relative change of a channel's motion in closed loop from which there is a gap to explain."""
FLOOR = np.array([0.01 if channel is Channel.THUMB_ABDUCTION else 2e-4 for channel in Channel])
"""Differences below this are no gap, (7,), m, abduction rad: what a hand's static error alone makes."""


@dataclass(frozen=True)
class ChannelGap:
    """One channel's share; standard deviations and root mean squares about the mean, m, abduction rad."""

    channel: Channel
    """Which."""
    simulated: float
    """Motion in the simulated episode."""
    replayed: float
    """Motion of the hand when the same actions are replayed."""
    residual: float
    """What remains between these two, apart from a constant offset."""
    offset: float
    """That offset, hand less simulator."""
    closed_loop: float
    """Motion of the hand when the policy runs on it."""
    cause: Cause
    """What explains the gap."""


def channel_gaps(simulated: Floats, replayed: Floats, closed_loop: Floats) -> tuple[ChannelGap, ...]:
    """Compare three traces channel by channel.

    Args:
        simulated: lengths after each action of the simulated episode, (steps, 7), m, abduction rad.
        replayed: lengths of the hand after the same actions, (steps, 7).
        closed_loop: lengths of the hand under the policy, (any, 7).

    Raises:
        ValueError: `simulated` and `replayed` are not both (steps, 7).
    """
    if simulated.shape != replayed.shape or simulated.shape[1:] != (len(Channel),):
        raise ValueError(f"both traces must be (steps, 7) of one length, got {simulated.shape} and {replayed.shape}")
    difference = replayed - simulated
    motions = simulated.std(axis=0), replayed.std(axis=0), difference.std(axis=0), closed_loop.std(axis=0)
    gaps = []
    for channel, sim, replay, residual, closed in zip(Channel, *motions, strict=True):
        gaps.append(
            ChannelGap(
                channel=channel,
                simulated=float(sim),
                replayed=float(replay),
                residual=float(residual),
                offset=float(difference[:, channel].mean()),
                closed_loop=float(closed),
                cause=_cause(float(sim), float(residual), float(closed), float(FLOOR[channel])),
            )
        )
    return tuple(gaps)


def _cause(simulated: float, residual: float, closed_loop: float, floor: float) -> Cause:
    if residual > max(RESIDUAL_SHARE * simulated, floor):
        return "transmission"
    if abs(closed_loop - simulated) > max(MOTION_SHARE * simulated, floor):
        return "feedback"
    return "none"
