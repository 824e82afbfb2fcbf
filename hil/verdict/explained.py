"""Which findings of a run its likeliest cause accounts for."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from functools import cache

from aero.channels import Channel
from hil.verdict.causes import CAUSES
from hil.verdict.dictionary import load_dictionary
from hil.verdict.explanation import Effect, Explanation
from hil.verdict.findings import Finding, failed
from hil.verdict.judged_run import Result, Validation
from hil.verdict.locate import DRIVER_OR_MAP
from hil.verdict.run_end import Way
from hil.verdict.signature import Signature, places, signature
from hil.verdict.validation import limits_of

EXPECTED = 1.0
"""Compressed place from which on a cause is known to move a reading."""
TOLD, FAINT = 2, 0.3
"""Readings that a cause must move, and the part of it below which they count as not moved."""


def explained_findings(validation: Validation, cause: Explanation) -> tuple[Finding, ...]:
    """Return the failed findings that a cause accounts for.

    A cause accounts for a finding when it moved the same reading of a known hand, seen from the channel on which it
    sits, to the same side. When the driver is the cause, the hand's readings mean nothing, and it accounts for all.
    """
    if cause.cause == DRIVER_OR_MAP:
        return failed(validation.findings)
    known = _expected()[cause.cause]
    # Whatever is measured on a channel that does not move says nothing else.
    still = cause.channel is not None and CAUSES[cause.cause][1] is Effect.NOTHING_MOVES
    found = [
        finding
        for name, result in validation.judged.items()
        for finding in failed(result.findings)
        if _moves(known, feature := _feature(name, finding, cause.channel), _side(result, finding))
        or (still and feature.startswith("own/"))
    ]
    end = validation.end
    if end.finding is not None and (f"ended/{end.error_name}" in known or (end.way is Way.GATE and found)):
        found.append(end.finding)
    return tuple(found)


def _feature(experiment: str, finding: Finding, channel: Channel | None) -> str:
    """Return the name of the reading as `signature` gives it."""
    if finding.subject == "hand":
        role = "hand"
    elif channel is not None and finding.subject == channel.label:
        role = "own"
    else:
        role = "others"
    return f"{role}/{experiment}/{finding.check}"


def _moves(known: Mapping[str, tuple[float, float]], feature: str, side: float) -> bool:
    low, high = known.get(feature, (0.0, 0.0))
    return low <= -EXPECTED if side < 0 else high >= EXPECTED


def _side(result: Result, finding: Finding) -> float:
    """Return on which side of its limits a reading lies: below zero when it is too small."""
    value = result.measured.get(finding.subject, {}).get(finding.check)
    if value is None:
        return 1.0
    for limit in limits_of(result.recording.header):
        if (limit.experiment, limit.metric) == (result.recording.header.experiment, finding.check) and (
            finding.subject in limit.subjects
        ):
            return limit.place(value)
    return 1.0


@cache
def _expected() -> Mapping[str, Mapping[str, tuple[float, float]]]:
    """Return, by cause, the least and the greatest place to which it moved each reading of a known hand."""
    found: dict[str, dict[str, tuple[float, float]]] = defaultdict(dict)
    for entry in load_dictionary():
        _widen(found[entry.cause], entry.features)
    return defaultdict(dict, found)


def _widen(known: dict[str, tuple[float, float]], features: Signature) -> None:
    for name, value in features.items():
        low, high = known.get(name, (0.0, 0.0))
        known[name] = min(low, value), max(high, value)


def missed(validation: Validation, cause: Explanation, experiments: Sequence[str]) -> bool:
    """Return whether a cause would have been seen in experiments in which nothing is off, had it been there."""
    if cause.fault is None:
        return False
    named = [entry for entry in load_dictionary() if entry.fault.name == cause.fault.name]
    alike = [entry.features for entry in named if not entry.fault.at_s]
    expected: dict[str, float] = defaultdict(float)
    for features in alike:
        for name, value in features.items():
            if name.split("/")[1] in experiments:
                expected[name] += value / len(alike)
    told = {name: value for name, value in expected.items() if abs(value) >= EXPECTED}
    numbers = {name: validation.results[name].measured for name in experiments}
    limits = limits_of(validation.results[experiments[0]].recording.header)
    seen = signature(places(numbers, limits), cause.channel)
    shown = sum(max(0.0, seen.get(name, 0.0) / value) for name, value in told.items())
    return len(told) >= TOLD and shown < FAINT * len(told)
