"""Sweeps of the routed hand, and what is captured of it meanwhile."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from aero.channels import THUMB, Channel
from hil.checks.shared.side_by_side import SimulatedHand

Floats = NDArray[np.float64]

STAIRCASE_LEVELS = 20
GRID_LEVELS = 10
SAMPLES_A_LEVEL = 24
SAMPLE_S = 0.02
"""As in the paper's run, 50 samples a second."""
SETTLE_S = 1.5
"""From one end of a range to rest; the slowest joint needs under a second."""
GRID_HOLD_S = 0.6
"""From one grid node to rest at the next."""


class JointedSimulator(SimulatedHand, Protocol):
    """A simulator that also gives its joint angles."""

    def joint_angles(self) -> Floats:
        """Return the joints, (16,) rad."""
        ...


@dataclass(frozen=True)
class Capture:
    """Samples of a hand that was swept."""

    lengths: Floats
    """(n, 7) sensors, m and rad."""
    joints: Floats
    """(n, 16) joint angles, rad."""
    sweep: NDArray[np.int64]
    """(n,) number of the sweep that a sample belongs to; errors within one are not independent."""


def joined(captures: Iterable[Capture]) -> Capture:
    """Return several captures as one, their sweeps numbered through."""
    parts = list(captures)
    offsets = np.cumsum([0, *(part.sweep.max() + 1 for part in parts)])[:-1]
    return Capture(
        np.concatenate([part.lengths for part in parts]),
        np.concatenate([part.joints for part in parts]),
        np.concatenate([part.sweep + offset for part, offset in zip(parts, offsets, strict=True)]),
    )


def staircase(hand: JointedSimulator, channel: Channel) -> Capture:
    """Step one channel over its command range and back in 20 equal levels, the others open; 50 samples a second."""
    goal = _open(hand)
    opened, closed = _ends(hand, channel)
    rise = np.linspace(opened, closed, STAIRCASE_LEVELS + 1)
    goal[channel] = opened
    hand.command(goal)
    hand.advance(SETTLE_S)
    samples = []
    for level in (*rise, *rise[::-1]):
        goal[channel] = level
        hand.command(goal)
        for _ in range(SAMPLES_A_LEVEL):
            hand.advance(SAMPLE_S)
            samples.append((hand.lengths(), hand.joint_angles()))
    return _capture(samples)


def thumb_grid(hand: JointedSimulator, abduction: float) -> Capture:
    """Settle at the 10 x 10 nodes over both thumb cables' command ranges, abduction (rad) held.

    One sweep a level of the CMC cable, (100, ...) samples in all, both cables from open to closed.
    """
    rows = []
    cmc_open, cmc_closed = _ends(hand, Channel.THUMB_CMC_FLEXION)
    flexor_open, flexor_closed = _ends(hand, Channel.THUMB_FLEXOR)
    for cmc in np.linspace(cmc_open, cmc_closed, GRID_LEVELS):
        goal = _open(hand)
        goal[[*THUMB]] = abduction, cmc, flexor_open
        hand.command(goal)
        hand.advance(SETTLE_S)
        samples = []
        for flexor in np.linspace(flexor_open, flexor_closed, GRID_LEVELS):
            goal[Channel.THUMB_FLEXOR] = flexor
            hand.command(goal)
            hand.advance(GRID_HOLD_S)
            samples.append((hand.lengths(), hand.joint_angles()))
        rows.append(_capture(samples))
    return joined(rows)


def _open(hand: JointedSimulator) -> Floats:
    """Reset the hand and return the command that holds it open."""
    hand.reset()
    return np.clip(hand.lengths(), *hand.command_range.T)


def _ends(hand: JointedSimulator, channel: Channel) -> tuple[float, float]:
    low, high = hand.command_range[channel]
    return (low, high) if channel == Channel.THUMB_ABDUCTION else (high, low)


def _capture(samples: list[tuple[Floats, Floats]]) -> Capture:
    lengths, joints = zip(*samples, strict=True)
    return Capture(np.array(lengths), np.array(joints), np.zeros(len(samples), np.int64))
