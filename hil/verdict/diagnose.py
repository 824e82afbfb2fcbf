"""Where something is wrong in a run that failed, and the causes that explain it, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from aero.firmware import DEFAULT_FIRMWARE
from hil.checks import Measured
from hil.faults import CATALOGUE, Fault
from hil.verdict.ending import EndSignature
from hil.verdict.explanation import Diagnosis, Explanation
from hil.verdict.limits import Limit
from hil.verdict.locate import MISTAKEN, OLDER_FIRMWARE, channels_off, driver_mistaken, older_firmware, windows_moved
from hil.verdict.next_step import cause_words, metric_words, only
from hil.verdict.other_firmware import other_firmware
from hil.verdict.reference import load_reference
from hil.verdict.signature import Places, Signature, excesses, places, signature

KEPT = 5
"""Causes that are kept, the likeliest."""


def diagnose(
    numbers: Mapping[str, Measured],
    limits: Sequence[Limit],
    ending: EndSignature,
    firmware: str = DEFAULT_FIRMWARE,
    others: Mapping[str, Sequence[Limit]] = MappingProxyType({}),
) -> Diagnosis:
    """Return where something is wrong in a run that failed, what kind of effect it has, and which causes fit.

    Args:
        numbers: what was measured, by experiment.
        limits: of the hand.
        ending: how the run ended.
        firmware: version that was named.
        others: limits of hands with other versions, see `limits_of_others`; none are asked when there are none.
    """
    beyond = excesses(numbers, limits)
    if driver_mistaken(beyond):
        return replace(MISTAKEN, off=channels_off(beyond))
    if older_firmware(beyond, ending):
        return replace(OLDER_FIRMWARE, off=channels_off(beyond))
    plain = windows_moved(numbers, beyond) or other_firmware(numbers, beyond, firmware, others)
    if plain is not None:
        return replace(plain, off=channels_off(beyond))
    found = {**places(numbers, limits), **ending.places}
    told = load_reference().diagnosed(found, beyond)
    return replace(told, causes=_told(told.causes[:KEPT], found), off=channels_off(beyond))


def _told(ranked: Sequence[Explanation], found: Places) -> tuple[Explanation, ...]:
    """Return causes with what they mean, and what would tell each from the next."""
    told = []
    for i, explanation in enumerate(ranked):
        assert explanation.fault is not None
        look = ""
        if i + 1 < len(ranked):
            after = ranked[i + 1]
            assert after.fault is not None
            view = signature(found, explanation.channel)
            look = _next_look(_features(explanation.fault), _features(after.fault), view, after.cause)
        told.append(replace(explanation, meaning=f"{CATALOGUE[explanation.fault.name].meaning}.", next_look=look))
    return tuple(told)


def _features(fault: Fault) -> Signature:
    """Return what is known of a fault of the reference."""
    return next(entry.features for entry in load_reference().known.entries if entry.fault == fault)


def telling(first: Signature, second: Signature, seen: Mapping[str, float]) -> str | None:
    """Return the feature that differs most between two causes and was not seen in this run, None when there is none."""
    # In the order of their names, so that equal gaps give the same answer in every run.
    unseen = sorted(name for name in first.keys() | second.keys() if name not in seen)
    gaps = {name: abs(first.get(name, 0.0) - second.get(name, 0.0)) for name in unseen}
    return max(gaps, key=lambda name: gaps[name], default=None)


def _next_look(first: Signature, second: Signature, view: Signature, other: str) -> str:
    feature = telling(first, second, view)
    if feature is None:
        return f"No further reading tells it from {cause_words(other)}; look at the hand."
    role, _, check = feature.partition("/")
    if check.startswith("ended/"):
        return f"To tell it from {cause_words(other)}, validate again and see whether the run ends in the same way."
    experiment, _, metric = check.partition("/")
    where = {"own": "of this channel", "others": "of the other channels", "hand": "of the hand"}[role]
    more = abs(first.get(feature, 0.0)) > abs(second.get(feature, 0.0))
    return (
        f"To tell it from {cause_words(other)}, run `{only(experiment)}`: this cause "
        f"{'changes' if more else 'does not change'} the {metric_words(experiment, metric)} {where}."
    )
