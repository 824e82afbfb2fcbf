"""Where something is wrong in a run that failed, and the causes that explain it, in words."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import TypeVar

from aero.channels import Channel
from hil.checks import Measured
from hil.faults import CATALOGUE, Fault
from hil.verdict.causes import CAUSES
from hil.verdict.dictionary import Entry, load_dictionary
from hil.verdict.explain import explain, telling
from hil.verdict.explanation import Diagnosis, Effect, Explanation, LikelyEffect, Place, Whereabouts
from hil.verdict.limits import Limit
from hil.verdict.locate import MISTAKEN, channels_off, driver_mistaken
from hil.verdict.next_step import cause_words, metric_words, only
from hil.verdict.signature import Places, Signature, excesses, places, signature

Of = TypeVar("Of")
KEPT = 5
"""Causes that are kept, the likeliest."""
SHOWN_FROM = 0.05
"""Share from which on a cause is one that fits."""


def diagnose(numbers: Mapping[str, Measured], limits: Sequence[Limit], ended: str, not_run: Sequence[str]) -> Diagnosis:
    """Return where something is wrong in a run that failed, what kind of effect it has, and which causes fit.

    Args:
        numbers: what was measured, by experiment.
        limits: of the hand.
        ended: name of the error that ended the run, empty when there was none.
        not_run: experiments that were to run and did not come to their end.
    """
    beyond = excesses(numbers, limits)
    if driver_mistaken(beyond):
        return replace(MISTAKEN, off=channels_off(beyond))
    found = places(numbers, limits)
    ranked = explain(found, ended, not_run, _dictionary())
    where: dict[tuple[Place, Channel | None], float] = defaultdict(float)
    effects: dict[Effect, float] = defaultdict(float)
    for one in ranked:
        place, effect = CAUSES.get(one.cause, (Place.ONE_CHANNEL, Effect.SENSOR))
        where[place, one.channel if place is Place.ONE_CHANNEL else None] += one.probability
        effects[effect] += one.probability
    return Diagnosis(
        tuple(Whereabouts(place, channel, share) for (place, channel), share in _ranked(where)),
        tuple(LikelyEffect(effect, share) for effect, share in _ranked(effects)),
        _told(ranked[:KEPT], found, ended),
        tuple(one.cause for one in ranked[:KEPT] if one.probability >= SHOWN_FROM),
        channels_off(beyond),
    )


def _told(ranked: Sequence[Explanation], found: Places, ended: str) -> tuple[Explanation, ...]:
    """Return causes with what they mean, and what would tell each from the next."""
    entries: dict[tuple[str, Fault | None], Entry] = {(entry.cause, entry.fault): entry for entry in _dictionary()}
    told = []
    for i, explanation in enumerate(ranked):
        view = signature(found, ended, explanation.channel)
        after = ranked[i + 1] if i + 1 < len(ranked) else None
        look = ""
        if after is not None:
            look = _next_look(
                entries[explanation.cause, explanation.fault].features,
                entries[after.cause, after.fault].features,
                view,
                after.cause,
            )
        assert explanation.fault is not None
        meaning = f"{CATALOGUE[explanation.fault.name].meaning}."
        told.append(replace(explanation, meaning=meaning, next_look=look))
    return tuple(told)


def _next_look(first: Signature, second: Signature, view: Signature, other: str) -> str:
    feature = telling(first, second, view)
    if feature is None:
        return f"No further reading tells it from {cause_words(other)}; look at the hand."
    role, _, check = feature.partition("/")
    if role == "ended":
        return f"To tell it from {cause_words(other)}, validate again and see whether the run comes to its end."
    experiment, _, metric = check.partition("/")
    where = {"own": "of this channel", "others": "of the other channels", "hand": "of the hand"}[role]
    more = abs(first.get(feature, 0.0)) > abs(second.get(feature, 0.0))
    return (
        f"To tell it from {cause_words(other)}, run `{only(experiment)}`: this cause "
        f"{'changes' if more else 'does not change'} the {metric_words(experiment, metric)} {where}."
    )


def _ranked(shares: Mapping[Of, float]) -> list[tuple[Of, float]]:
    return sorted(shares.items(), key=lambda pair: -pair[1])


@cache
def _dictionary() -> tuple[Entry, ...]:
    return load_dictionary()
