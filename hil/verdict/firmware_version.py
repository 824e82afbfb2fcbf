"""Detection of a healthy hand whose board runs another firmware than the named one.

No board reports its version, but each version has limits from healthy hands. A hand with readings out of limits for the
named version and all within limits for another is a healthy hand with the other version.
"""

from collections.abc import Mapping, Sequence

from aero.firmware import VERSION_GROUPS, Firmware, firmware_of
from hil.checks import JUDGED, Measured, metric_of
from hil.checks.shared.declaration import VersionRole
from hil.verdict.failures import EVIDENCE
from hil.verdict.limits import Key, Limit, excesses, load_limits, out_of_limits, within_limits
from hil.verdict.parts import listed

LEAST = 2
"""Number of readings that must be out of the named version's limits; a single one could be any fault's.

Readings of one kind on one subject in one experiment count once.
"""


def limits_of_others(named: str, *, guarded: bool) -> dict[str, tuple[Limit, ...]]:
    """Return the limits of each other version group, by the oldest version of the group."""
    others = [group[0] for group in VERSION_GROUPS if named not in group]
    return {version: load_limits(version, guarded=guarded) for version in others}


def reads_as(numbers: Mapping[str, Measured], named: str, *, guarded: bool) -> str:
    """Return a sentence naming the firmware version that explains the run, or "" if none does."""
    off = excesses(numbers, load_limits(named, guarded=guarded))
    found = other_versions(numbers, off, named, limits_of_others(named, guarded=guarded))
    return f"it reads as firmware {listed(map(versions_alike, found))}, or as a board not homed" if found else ""


def other_versions(
    numbers: Mapping[str, Measured], off: Mapping[Key, float | None], named: str, others: Mapping[str, Sequence[Limit]]
) -> tuple[str, ...]:
    """Return the versions for which the run's readings are those of a healthy hand, one per version group."""
    return tuple(version for version, limits in others.items() if _reads_as(numbers, off, named, version, limits))


def versions_alike(version: str) -> str:
    """Return the group of versions that move like this one, as text."""
    first, *rest = next(group for group in VERSION_GROUPS if version in group)
    return f"{first} or {rest[-1]}" if len(rest) == 1 else f"{first} to {rest[-1]}" if rest else first


def _reads_as(
    numbers: Mapping[str, Measured], off: Mapping[Key, float | None], named: str, version: str, limits: Sequence[Limit]
) -> bool:
    one, other = firmware_of(named), firmware_of(version)
    beyond = [key for key, excess in off.items() if out_of_limits(excess) and _compares(key, one, other)]
    pieces = {(experiment, EVIDENCE[experiment, metric], subject) for experiment, metric, subject in beyond}
    if len(pieces) < LEAST or not any(_role(key) is VersionRole.TELLS for key in beyond):
        return False
    by_other = excesses(numbers, limits)
    return all(within_limits(excess) for key, excess in by_other.items() if _compares(key, one, other))


def _compares(key: Key, one: Firmware, other: Firmware) -> bool:
    if JUDGED[key[0]].of_any_version or _role(key) is VersionRole.MAP:
        return False
    return one.settings == other.settings or _role(key) is not VersionRole.TORQUE


def _role(key: Key) -> VersionRole | None:
    metric = metric_of(*key)
    return None if metric is None else metric.version
