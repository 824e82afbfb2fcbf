"""Whether a run reads as a healthy hand that runs another firmware than was named.

No board tells its version. But each version has limits of its own, from healthy hands that ran it. A hand whose
readings are off by the limits of the version that was named, and all within those of another, is a healthy hand with
that other one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from aero.firmware import VERSION_GROUPS, Firmware, firmware_of
from hil.checks import Measured
from hil.verdict.limits import Key, Limit, excesses, load_limits, out_of_limits, within_limits
from hil.verdict.parts import listed

OF_THE_MAP = {
    ("staircase", "excursion_hand"),
    ("staircase", "tracking_rms"),
    ("staircase", "matched_steps"),
    ("staircase", "spring"),
}
"""Readings that the map of the named version makes; they say nothing of another."""
OF_THE_TORQUE = {("excursion", "stop_current")}
"""Readings that the torque decides, which is set as the named version has it."""
OF_THE_TEXT = {"session", "presence"}
"""Experiments that ask nothing that versions do differently but limits and boot text, which have their own findings."""
TELLING = {("coupling", "stop_without_abduction"), ("excursion", "closed_percent"), ("response", "telemetry_period")}
"""Readings that differ by more than healthy hands do: the palm stops CMC flexion at 54 to 61 % of the windows of 0.2.0,
at 47 to 50 % of those before; telemetry comes every 20 ms from `pre`, every 10 ms from the others."""
LEAST = 2
"""Readings that must be off by the named version; one alone could be any fault's."""


def limits_of_others(named: str, *, guarded: bool) -> dict[str, tuple[Limit, ...]]:
    """Return, by the oldest version of each other group that moves alike, the limits of its hands."""
    others = [group[0] for group in VERSION_GROUPS if named not in group]
    return {version: load_limits(version, guarded=guarded) for version in others}


def reads_as(numbers: Mapping[str, Measured], named: str, *, guarded: bool) -> str:
    """Return how another version than the named one explains a run, for people; empty where none does."""
    off = excesses(numbers, load_limits(named, guarded=guarded))
    found = other_versions(numbers, off, named, limits_of_others(named, guarded=guarded))
    return f"it reads as firmware {listed(map(versions_alike, found))}, or as a board not homed" if found else ""


def other_versions(
    numbers: Mapping[str, Measured], off: Mapping[Key, float | None], named: str, others: Mapping[str, Sequence[Limit]]
) -> tuple[str, ...]:
    """Return the versions, each the oldest of those that move alike, as which a run reads as a healthy hand."""
    return tuple(version for version, limits in others.items() if _reads_as(numbers, off, named, version, limits))


def versions_alike(version: str) -> str:
    """Return the versions that move as this one, in words."""
    first, *rest = next(group for group in VERSION_GROUPS if version in group)
    return f"{first} or {rest[-1]}" if len(rest) == 1 else f"{first} to {rest[-1]}" if rest else first


def _reads_as(
    numbers: Mapping[str, Measured], off: Mapping[Key, float | None], named: str, version: str, limits: Sequence[Limit]
) -> bool:
    one, other = firmware_of(named), firmware_of(version)
    beyond = [key for key, excess in off.items() if out_of_limits(excess) and _compares(key, one, other)]
    if len(beyond) < LEAST or not any((experiment, metric) in TELLING for experiment, metric, _ in beyond):
        return False
    by_other = excesses(numbers, limits)
    return all(within_limits(excess) for key, excess in by_other.items() if _compares(key, one, other))


def _compares(key: Key, one: Firmware, other: Firmware) -> bool:
    experiment, metric, _ = key
    if experiment in OF_THE_TEXT or (experiment, metric) in OF_THE_MAP:
        return False
    return one.settings == other.settings or (experiment, metric) not in OF_THE_TORQUE
