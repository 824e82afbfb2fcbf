"""Where something is wrong in a run: on one channel or on several, in the supply, the board, the link, or the host.

It is told by what a fault of each place has in common with every other one there, known or not: how many channels are
off and by how much together, whether all of them are, and what the link and the board show. A logistic model, which
`aero-hil learn` fits, weighs that.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from aero.channels import Channel
from hil.verdict.deviation import CHANNEL_READINGS, HAND_READINGS, HAND_WEIGHT, Deviation
from hil.verdict.explanation import Place, Whereabouts

SOME = 2.0
"""Energy that is nothing; shares are of what is beyond it."""
EXCHANGES = ("lost_replies", "stray_bytes", "round_trip", "backward_readings", "stale_readings", "telemetry_period")
"""Readings of the hand that only bytes and their times make."""
ALL_CHANNELS = (
    "replay/replay_delay",
    "replay/replay_shape",
    "staircase/rise_hand_ms",
    "excursion/stop_current",
    "excursion/closed_percent",
    "excursion/fist_travel",
    "audit/followed",
    "audit/pull",
)
"""Readings whose median over the channels counts."""

STOPS = tuple(name for name in CHANNEL_READINGS if name.startswith("ended/"))


def features(run: Deviation) -> dict[str, float]:
    """Return what tells the places of faults apart."""
    energies = run.energies
    first, second, _, middle, *_ = np.sort(energies)[::-1]
    beyond = energies.sum() + SOME
    readings = np.nan_to_num(run.channels)
    thumb = [row for row, name in enumerate(CHANNEL_READINGS) if name.startswith("coupling/")]
    hand = dict(zip(HAND_READINGS, (np.nan_to_num(run.hand) / HAND_WEIGHT).tolist(), strict=True))
    exchanges = sum(value**2 for name, value in hand.items() if name.partition("/")[2] in EXCHANGES)
    accused = np.count_nonzero(run.accused)
    return {
        "no channel is accused": float(accused == 0),
        "one channel is accused": float(accused == 1),
        "two channels are accused": float(accused == 2),
        "four channels are accused": float(accused >= 4),
        "share of the most accused": float(run.accused.max() / (run.accused.sum() + 0.5)),
        "share of the worst channel": float(first / beyond),
        "share of the next": float(second / beyond),
        "share of the thumb": float(energies[int(Channel.THUMB_ABDUCTION) :].sum() / beyond),
        "share of its coupling": float((readings[thumb] ** 2).sum() / beyond),
        "worst channel": float(np.log1p(first)),
        "next channel": float(np.log1p(second)),
        "middle channel": float(np.log1p(middle)),
        "exchanges": float(np.log1p(exchanges)),
        **{f"a channel {name}": float(readings[CHANNEL_READINGS.index(name)].any()) for name in STOPS},
        **{f"all {name}": _median(run, name) for name in ALL_CHANNELS},
        **hand,
    }


def _median(run: Deviation, name: str) -> float:
    row = run.channels[CHANNEL_READINGS.index(name)]
    return float(np.median(row[np.isfinite(row)])) if np.isfinite(row).any() else 0.0


@dataclass(frozen=True)
class Placing:
    """A logistic model of the places."""

    usual: Mapping[str, float]
    """What a reading, `experiment/metric`, is on most hands, once compressed; see `deviation`."""
    weights: Mapping[Place, Mapping[str, float]]
    """Place to feature to weight; `""` has the constant."""

    def shares(self, run: Deviation) -> dict[Place, float]:
        """Return how likely each place is; they add up to one."""
        found = features(run) | {"": 1.0}
        scores = np.array([sum(w * found[name] for name, w in row.items()) for row in self.weights.values()])
        likely = np.exp(scores - scores.max())
        return dict(zip(self.weights, (likely / likely.sum()).tolist(), strict=True))


def whereabouts(run: Deviation, shares: Mapping[Place, float]) -> tuple[Whereabouts, ...]:
    """Return places, the likeliest first; one channel is split over the channels by how far they are off."""
    energies = run.energies**2
    of_channels = energies / energies.sum() if energies.any() else np.full(len(Channel), 1.0 / len(Channel))
    found = [Whereabouts(place, None, share) for place, share in shares.items() if place is not Place.ONE_CHANNEL]
    found += [
        Whereabouts(Place.ONE_CHANNEL, channel, shares.get(Place.ONE_CHANNEL, 0.0) * float(of_channels[channel]))
        for channel in Channel
    ]
    return tuple(sorted(found, key=lambda one: -one.probability))
