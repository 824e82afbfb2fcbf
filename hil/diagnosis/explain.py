"""Ranking the faults that explain a run."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence

from aero.channels import Channel
from hil.diagnosis.dictionary import Entry
from hil.diagnosis.signature import KINDS, Excesses, Signature, signature
from hil.judging.explanation import Explanation

SCALE = 0.2
"""Distance between signatures over which a likeness falls to 1/e; chosen on the hands of the dictionary."""


def explain(
    found: Excesses, ended: str, not_run: Sequence[str], dictionary: Sequence[Entry]
) -> tuple[Explanation, ...]:
    """Return the causes that may explain a run, the likeliest first; their probabilities add up to one.

    Every entry is compared with the run as seen from each channel on which the fault could sit. Causes are equally
    likely beforehand, however many entries each has.
    """
    views = {channel: signature(found, ended, not_run, channel) for channel in (None, *Channel)}
    counts: dict[str, int] = defaultdict(int)
    for entry in dictionary:
        counts[entry.cause] += 1
    weights: dict[tuple[str, Channel | None], float] = defaultdict(float)
    best: dict[tuple[str, Channel | None], tuple[float, str]] = {}
    for entry in dictionary:
        for channel, view in views.items():
            if entry.kind != ("" if channel is None else KINDS[channel.label]):
                continue
            weight = math.exp(-distance(entry.features, view) / SCALE)
            key = (entry.cause, channel)
            weights[key] += weight / counts[entry.cause]
            best[key] = max(best.get(key, (0.0, "")), (weight, entry.fault))
    by_cause: dict[str, tuple[float, Channel | None]] = {}
    for (cause, channel), weight in weights.items():
        by_cause[cause] = max(by_cause.get(cause, (0.0, None)), (weight, channel), key=lambda pair: pair[0])
    total = sum(weight for weight, _ in by_cause.values()) or 1.0
    ranked = sorted(by_cause.items(), key=lambda item: -item[1][0])
    return tuple(
        Explanation(cause, channel, weight / total, best[cause, channel][1]) for cause, (weight, channel) in ranked
    )


def distance(one: Signature, other: Signature) -> float:
    """Return how different the patterns of two signatures are: one less the cosine between them, 0 to 2.

    A mild fault moves the same readings as a severe one by less, so the length of a signature says little.
    """
    lengths = [math.sqrt(sum(value**2 for value in signature.values())) for signature in (one, other)]
    if not all(lengths):
        return float(any(lengths))
    along = sum(value * other.get(name, 0.0) for name, value in one.items())
    return max(0.0, 1.0 - along / (lengths[0] * lengths[1]))


def telling(first: Signature, second: Signature, seen: Mapping[str, float]) -> str | None:
    """Return the feature that differs most between two causes and was not seen in this run, None when there is none."""
    # In the order of their names, so that equal gaps give the same answer in every run.
    unseen = sorted(name for name in first.keys() | second.keys() if name not in seen)
    gaps = {name: abs(first.get(name, 0.0) - second.get(name, 0.0)) for name in unseen}
    return max(gaps, key=lambda name: gaps[name], default=None)
