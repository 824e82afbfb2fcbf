"""The causes that explain a judged run, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache

from hil.checks import Measured
from hil.faults import CATALOGUE
from hil.verdict.dictionary import Entry, load_dictionary
from hil.verdict.explain import explain, telling
from hil.verdict.explanation import Explanation
from hil.verdict.limits import Limit
from hil.verdict.signature import Signature, places, signature

KEPT = 5
"""Causes that are kept, the likeliest."""


def diagnose(
    numbers: Mapping[str, Measured], limits: Sequence[Limit], ended: str, not_run: Sequence[str]
) -> tuple[Explanation, ...]:
    """Return the likeliest causes of a run that failed, each with what would tell it from the next.

    Args:
        numbers: what was measured, by experiment.
        limits: of the hand.
        ended: name of the error that ended the run, empty when there was none.
        not_run: experiments that were to run and did not come to their end.
    """
    found = places(numbers, limits)
    ranked = explain(found, ended, not_run, _dictionary())[:KEPT]
    entries = {(entry.cause, entry.fault): entry for entry in _dictionary()}
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
        meaning = f"{CATALOGUE[explanation.fault.name].meaning}."
        told.append(replace(explanation, meaning=meaning, next_look=look))
    return tuple(told)


def _next_look(first: Signature, second: Signature, view: Signature, other: str) -> str:
    feature = telling(first, second, view)
    if feature is None:
        return f"No further reading tells it from {other}; look at the hand."
    role, _, check = feature.partition("/")
    if role == "ended":
        return f"To tell it from {other}, validate again and see whether {check} comes to its end."
    where = {"own": "of this channel", "others": "of the other channels", "hand": "of the hand"}[role]
    more = abs(first.get(feature, 0.0)) > abs(second.get(feature, 0.0))
    return (
        f"To tell it from {other}, measure {check} {where} again: this cause {'moves' if more else 'does not move'} it."
    )


@cache
def _dictionary() -> tuple[Entry, ...]:
    return load_dictionary()
