"""Forbidden regions of a hand: pairs of channels that bind together, and the gate that keeps commands out of them.

Theory of operation
===================

A region forbids two channels to be beyond their edges at the same time, as "abduction below 0.6 while CMC flexion is
below 0.3". The hand is outside as long as one of the two, the *holder*, is on its own side of its edge. The board moves
each channel at its own speed, so the path between two commands is not known. The gate therefore never lets the second
channel cross its edge before the first is known, by command and by encoder, to be back on its side:

1. If a channel is outside now, and the goal leaves it outside, every path to the goal is permitted.
2. Otherwise a channel that is outside now stops at its edge; the other one may go to its goal. Once an encoder shows
   the other one outside, rule 1 may release the first.
3. If both are inside, as on a hand that was switched on there, neither goes deeper than it is or was told to go, and
   the one with the shorter way leaves.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.channels import Channel
from aero.floats import Floats
from aero.protocol import MAX_CODE, position_codes

MARGIN = 0.04
"""Distance from an edge at which a channel stops, fraction of the window. The emulated thumb holds a goal within 0.025,
and a blind command is lowered by up to 0.02."""


@dataclass(frozen=True)
class Edge:
    """Edge of a region on one channel."""

    channel: Channel
    share: float
    """Fraction of the command window, 0 open to 1 closed, exclusive."""
    above: bool
    """True if the region lies above the edge."""

    def depth(self, shares: Floats) -> float:
        """Return the distance of a pose, (7,) shares of the window, beyond the edge; negative outside."""
        beyond = float(shares[self.channel]) - self.share
        return beyond if self.above else -beyond

    def share_at(self, depth: float) -> float:
        """Return the share of the window at a depth, within the window."""
        return min(max(self.share + (depth if self.above else -depth), 0.0), 1.0)

    def __str__(self) -> str:
        return f"{self.channel.label} {'above' if self.above else 'below'} {self.share:g}"


@dataclass(frozen=True)
class Region:
    """Two bounds that a hand must not exceed at the same time.

    Raises:
        ValueError: the same channel twice, or an edge outside the window.
    """

    bounds: tuple[Edge, Edge]

    def __post_init__(self) -> None:
        first, second = self.bounds
        if first.channel is second.channel:
            raise ValueError(f"a forbidden region has two channels, got {first.channel.label} twice")
        for bound in self.bounds:
            if not 0.0 < bound.share < 1.0:
                raise ValueError(f"{bound}: expected an edge between 0 and 1, fractions of the command window")

    @classmethod
    def of(cls, table: Mapping[str, Any]) -> Self:
        """Return the region of a table `{channel: {"below" or "above": edge}}` with two channels.

        Raises:
            ValueError: another form, an unknown channel, or an edge outside the window.
        """
        if len(table) != 2:
            raise ValueError(f"a forbidden region has two channels, got {', '.join(map(str, table)) or 'none'}")
        first, second = (_bound(label, sides) for label, sides in table.items())
        return cls((first, second))

    def as_table(self) -> dict[str, dict[str, float]]:
        """Return the table of `of`."""
        return {one.channel.label: {"above" if one.above else "below": one.share} for one in self.bounds}

    def holds(self, shares: Floats) -> bool:
        """Return whether a pose, (7,) shares of the window, lies in the region."""
        return all(bound.depth(shares) > 0.0 for bound in self.bounds)

    def __str__(self) -> str:
        return " while ".join(map(str, self.bounds))


def _bound(label: str, sides: Any) -> Edge:
    labels = {channel.label: channel for channel in Channel}
    if label not in labels:
        raise ValueError(f"no channel is called {label!r}; known are {', '.join(labels)}")
    if not (isinstance(sides, Mapping) and len(sides) == 1 and {*sides} <= {"below", "above"}):
        raise ValueError(f"{label}: expected {{ below = EDGE }} or {{ above = EDGE }}, got {sides!r}")
    ((side, edge),) = sides.items()
    if isinstance(edge, bool) or not isinstance(edge, int | float):
        raise ValueError(f"{label}: expected a number as edge, got {edge!r}")
    return Edge(labels[label], float(edge), side == "above")


class Gate:
    """Filter of position commands by forbidden regions, from the latest command and the latest encoder reading."""

    def __init__(self, regions: Iterable[Region] = ()) -> None:
        self._regions = tuple(regions)
        self._seen: Floats | None = None
        self._wanted: NDArray[np.int64] | None = None
        self._sent: NDArray[np.int64] | None = None
        # A reading may be older than the commands of the poll before it, so those of two polls count.
        self._spans: list[Floats] = []

    @property
    def bars(self) -> bool:
        """True with at least one region."""
        return bool(self._regions)

    def seen(self, codes: ArrayLike) -> None:
        """Record an encoder reading, (7,) codes in 0..65535."""
        self._seen = np.asarray(codes, np.float64) / MAX_CODE
        self._spans = [*self._spans[-1:], self._span(self._sent)]

    def forget(self) -> None:
        """Drop the past commands, as for a motion of the firmware's own."""
        self._sent = self._wanted = None
        self._spans = []

    def passed(self, codes: ArrayLike) -> NDArray[np.int64]:
        """Return the codes, (7,), to send for a command, and record both."""
        self._wanted = position_codes(codes)
        return self._record(self.outcome(self._wanted))

    def released(self) -> NDArray[np.int64] | None:
        """Return the codes to send if the latest command may go further since it was sent, or None."""
        if self._wanted is None or self._sent is None or not self._regions:
            return None
        further = self.outcome(self._wanted)
        return None if np.array_equal(further, self._sent) else self._record(further)

    def outcome(self, codes: ArrayLike) -> NDArray[np.int64]:
        """Return the codes, (7,), that `passed` would return, without recording."""
        wanted = position_codes(codes)
        if not self._regions:
            return wanted
        goal = wanted / MAX_CODE
        for _ in self._regions:  # the edge of one region may lie in another
            for region in self._regions:
                self._keep_out(region, goal)
        return position_codes(np.rint(goal * MAX_CODE).astype(np.int64))

    def _record(self, codes: NDArray[np.int64]) -> NDArray[np.int64]:
        self._sent = codes
        now = self._span(codes)
        low, high = self._spans.pop() if self._spans else now
        self._spans.append(np.array([np.fmin(low, now[0]), np.fmax(high, now[1])]))
        return codes

    @staticmethod
    def _span(codes: NDArray[np.int64] | None) -> Floats:
        """Return lowest and highest shares of one command, (2, 7); NaN of an unknown one."""
        return np.full((2, len(Channel)), np.nan) if codes is None else np.tile(codes / MAX_CODE, (2, 1))

    def _keep_out(self, region: Region, goal: Floats) -> None:
        """Change `goal` so that no path to it crosses the region."""
        seen = goal if self._seen is None else self._seen
        poses = [seen, *(pose for span in self._spans for pose in span if not np.isnan(pose).any())]
        outside = [one for one in region.bounds if all(one.depth(pose) <= 0.0 for pose in poses)]
        stays = [one for one in region.bounds if one.depth(goal) <= -MARGIN]
        if any(one in stays for one in outside):
            return
        if outside:
            _stop_at(outside[0], -MARGIN, goal)
            return
        leaves = stays[0] if stays else min(region.bounds, key=lambda one: one.depth(seen))
        for one in region.bounds:
            # Already told to leave, a channel may be outside before a reading shows it.
            shallowest = max(-MARGIN, min(one.depth(pose) for pose in poses))
            _stop_at(one, -MARGIN if one is leaves else shallowest, goal)


def _stop_at(bound: Edge, depth: float, goal: Floats) -> None:
    if bound.depth(goal) > depth:
        goal[bound.channel] = bound.share_at(depth)
