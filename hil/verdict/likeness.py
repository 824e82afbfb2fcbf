"""How well each known fault explains a run: the share of its deviation that the fault accounts for.

A fault of one channel predicts its own readings there and nothing elsewhere; a fault of the hand predicts the same on
all channels. So a known fault that would have to move six healthy channels explains a run with one bad channel badly.
The same fault, more or less severe, moves the readings further or less far; the prediction is scaled to fit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from aero.channels import FINGERS, Channel
from hil.faults.fault import Fault
from hil.verdict.causes import CAUSES
from hil.verdict.deviation import CHANNEL_READINGS, ENDED, HAND, HAND_READINGS, HAND_WEIGHT, Deviation, Floats, off
from hil.verdict.dictionary import Entry
from hil.verdict.explanation import Place

THUMB = tuple(channel for channel in Channel if channel not in FINGERS)
MOST_SEVERE = 2.0
"""A known fault may be so many times further off than it was learned."""


@dataclass(frozen=True)
class Likeness:
    """How well one cause explains a run at one place."""

    cause: str
    channel: Channel | None
    explained: float
    """Share of the deviation, 0 to 1."""
    fault: Fault
    """The known one that does it best."""


class Known:
    """The dictionary as arrays."""

    def __init__(self, entries: Sequence[Entry], usual: Mapping[str, float]) -> None:
        """Take the entries; `usual` is that of `deviation`."""
        self.entries = tuple(entries)
        self._hand = np.array([_on_hand(entry, usual) for entry in entries])
        self._at: dict[Channel | None, tuple[list[int], Floats]] = {}
        """For each seat the entries that may sit there, and what they do to all channels, (n, readings, 7)."""
        for seat in (None, *Channel):
            indices = [i for i, entry in enumerate(entries) if seat in _seats(entry)]
            self._at[seat] = indices, np.array([_on_channels(entries[i], seat, usual) for i in indices])

    def explained(self, run: Deviation, *, leaving_out: int | None = None) -> tuple[Likeness, ...]:
        """Return how well each cause explains a run, at each place where it may sit, the best first.

        Args:
            run: how it departs from healthy hands.
            leaving_out: an entry that is not asked, when the run is its own.
        """
        best: dict[tuple[str, Channel | None], Likeness] = {}
        heard, measured = np.isfinite(run.hand), np.isfinite(run.channels)
        hand, readings = np.nan_to_num(run.hand), np.nan_to_num(run.channels)
        for seat, (indices, known) in self._at.items():
            if not indices:
                continue
            on_hand = self._hand[indices] * heard
            alike = np.einsum("nrc,rc->n", known, readings) + on_hand @ hand
            power = np.einsum("nrc,rc->n", known**2, measured.astype(float)) + (on_hand**2).sum(axis=1)
            scale = np.clip(alike / np.maximum(power, 1e-9), 0.0, MOST_SEVERE)
            shares = (2.0 * scale * alike - scale**2 * power) / max(run.total, 1e-9)
            for index, share in zip(indices, shares.tolist(), strict=True):
                if index == leaving_out:
                    continue
                entry = self.entries[index]
                key = (entry.cause, seat)
                if key not in best or share > best[key].explained:
                    best[key] = Likeness(entry.cause, seat, share, entry.fault)
        return tuple(sorted(best.values(), key=lambda one: (-one.explained, one.cause, str(one.channel))))


def _seats(entry: Entry) -> tuple[Channel | None, ...]:
    """Return where a fault may sit as well: one of several channels stays where it was learned."""
    return entry.seats if CAUSES[entry.cause][0] is Place.ONE_CHANNEL else (None,)


def _on_channels(entry: Entry, seat: Channel | None, usual: Mapping[str, float]) -> Floats:
    """Return what a fault does to all channels when it sits on one, (readings, 7)."""
    found = np.zeros((len(CHANNEL_READINGS), len(Channel)))
    own, others = (
        np.array([_feature(entry, f"{role}/{name}", usual) for name in CHANNEL_READINGS]) for role in ("own", "others")
    )
    if seat is not None:
        found[:, seat] = own
    elif entry.fault.channel is None:
        found[:] = others[:, None]
    else:  # two or three channels that are mixed up
        digit = FINGERS if entry.fault.channel in FINGERS else THUMB
        found[:, list(digit)] = others[:, None]
        found[:, entry.fault.channel] = own
    return found


def _on_hand(entry: Entry, usual: Mapping[str, float]) -> Floats:
    return HAND_WEIGHT * np.array([_feature(entry, f"{HAND}/{name}", usual) for name in HAND_READINGS])


def _feature(entry: Entry, name: str, usual: Mapping[str, float]) -> float:
    """Return a feature of a fault without what any hand reads; zero for what was not measured."""
    value = entry.features.get(name)
    reading = name.partition("/")[2]
    if value is None:
        return 0.0
    return off(value, usual.get(reading, 0.0)) if not reading.startswith("ended/") else ENDED
