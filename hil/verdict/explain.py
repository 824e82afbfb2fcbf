"""Ranking the faults that explain a run."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence, Set

from aero.channels import Channel
from hil.faults.fault import Fault
from hil.verdict.dictionary import Entry
from hil.verdict.explanation import Explanation
from hil.verdict.signature import Places, Signature, signature

SCALE = 0.5
"""Distance between signatures over which a likeness falls to 1/e; chosen on the hands of the dictionary."""


def explain(found: Places, ended: str, not_run: Sequence[str], dictionary: Sequence[Entry]) -> tuple[Explanation, ...]:
    """Return the causes that may explain a run, the likeliest first; their probabilities add up to one.

    Every entry is compared with the run as seen from each channel on which the fault could sit, in the experiments
    that were to run. Causes are equally likely beforehand, however many entries each has.
    """
    asked = {experiment for experiment, _, _ in found} | set(not_run)
    views = {channel: signature(found, ended, channel) for channel in (None, *Channel)}
    counts = Counter(entry.cause for entry in dictionary)
    far = [
        (distance(_of(asked, entry.features), view), entry, channel)
        for channel, view in views.items()
        for entry in dictionary
        if channel in entry.seats
    ]
    nearest = min((away for away, _, _ in far), default=0.0)
    weights: dict[tuple[str, Channel | None], float] = defaultdict(float)
    best: dict[tuple[str, Channel | None], tuple[float, Fault]] = {}
    for away, entry, channel in far:
        weight = math.exp((nearest - away) / SCALE)
        key = (entry.cause, channel)
        weights[key] += weight / counts[entry.cause]
        best[key] = max(best.get(key, (-1.0, entry.fault)), (weight, entry.fault), key=_weight_then_text)
    by_cause: dict[str, tuple[float, Channel | None]] = {}
    for (cause, channel), weight in weights.items():
        by_cause[cause] = max(by_cause.get(cause, (-1.0, None)), (weight, channel), key=lambda pair: pair[0])
    total = sum(weight for weight, _ in by_cause.values()) or 1.0
    ranked = sorted(by_cause.items(), key=lambda item: -item[1][0])
    return tuple(
        Explanation(cause, channel, weight / total, best[cause, channel][1]) for cause, (weight, channel) in ranked
    )


def _weight_then_text(pair: tuple[float, Fault]) -> tuple[float, str]:
    """Order faults that are equally like the run by their text, so that every run names the same one."""
    return pair[0], str(pair[1])


def distance(one: Signature, other: Signature) -> float:
    """Return how far two signatures are apart: the sum of the differences of their features.

    So a likeness falls with every reading as if readings were spread about the known ones by Laplace's law.
    """
    return sum(abs(one.get(name, 0.0) - other.get(name, 0.0)) for name in one.keys() | other.keys())


def _of(asked: Set[str], features: Signature) -> Signature:
    """Return the features that a run of these experiments can have."""
    return {name: value for name, value in features.items() if _experiment(name) in asked or name.startswith("ended/")}


def _experiment(feature: str) -> str:
    return feature.split("/")[1]


def telling(first: Signature, second: Signature, seen: Mapping[str, float]) -> str | None:
    """Return the feature that differs most between two causes and was not seen in this run, None when there is none."""
    # In the order of their names, so that equal gaps give the same answer in every run.
    unseen = sorted(name for name in first.keys() | second.keys() if name not in seen)
    gaps = {name: abs(first.get(name, 0.0) - second.get(name, 0.0)) for name in unseen}
    return max(gaps, key=lambda name: gaps[name], default=None)
