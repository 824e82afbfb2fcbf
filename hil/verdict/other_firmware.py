"""Whether a run reads as a healthy hand that runs another firmware than was named.

No board tells its version. But each version has limits of its own, from healthy hands that ran it. A hand whose
readings are off by the limits of the version that was named, and all within those of another, is a healthy hand with
that other one.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from aero.actuation.window import SHIFT_CLOSING
from aero.channels import Channel
from aero.firmware import ALIKE, Firmware, firmware_of
from hil.checks import Measured
from hil.verdict.explanation import Diagnosis, Effect, Explanation, LikelyEffect, Place, Whereabouts
from hil.verdict.limits import Limit, load_limits
from hil.verdict.signature import Key, excesses, out_of_limits

OF_THE_MAP = {
    ("excursion", "closed_angle"),
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
SURE = 0.9
"""How likely such a run is of another firmware (assumption). None of 111 drawn hands with another fault read so, and 13
of 14 with another firmware did (`docs/campaign.md`); 0.9 holds while fewer than 1 in 500 of the others do."""


def limits_of_others(kind: str, named: str, *, guarded: bool) -> dict[str, tuple[Limit, ...]]:
    """Return, by the oldest version of each other group that moves alike, the limits of its hands."""
    others = [group[0] for group in ALIKE if named not in group]
    return {version: load_limits(kind, version, guarded=guarded) for version in others}


def other_firmware(
    numbers: Mapping[str, Measured], off: Mapping[Key, float], named: str, others: Mapping[str, Sequence[Limit]]
) -> Diagnosis | None:
    """Return what is said of a run that reads as a healthy hand with another firmware; None when it does not.

    Args:
        numbers: what was measured, by experiment.
        off: excesses by the limits of the named version, see `Limit.excess`.
        named: version that was named.
        others: limits by version, see `limits_of_others`.
    """
    found = [version for version, limits in others.items() if _reads_as(numbers, off, named, version, limits)]
    if not found:
        return None
    words = " or ".join(_alike(version) for version in found)
    causes = [("version", f"The hand reads as a healthy one with firmware {words}.", Effect.VERSION)]
    if _shifts(named) and not all(_shifts(version) for version in found):
        causes.append(("nvs_lost", "The board was not homed since it was flashed, or lost its zeros.", Effect.RESTART))
    share = SURE / len(causes)
    return Diagnosis(
        (Whereabouts(Place.BOARD, None, SURE),),
        tuple(LikelyEffect(effect, share) for _, _, effect in causes),
        tuple(Explanation(cause, None, share, None, meaning) for cause, meaning, _ in causes),
        tuple(cause for cause, _, _ in causes),
    )


def _reads_as(
    numbers: Mapping[str, Measured], off: Mapping[Key, float], named: str, version: str, limits: Sequence[Limit]
) -> bool:
    one, other = firmware_of(named), firmware_of(version)
    beyond = [key for key, excess in off.items() if out_of_limits(excess) and _compares(key, one, other)]
    if len(beyond) < LEAST or not any((experiment, metric) in TELLING for experiment, metric, _ in beyond):
        return False
    if not all(subject in _changed(one, other) for _, _, subject in beyond):
        return False
    by_other = excesses(numbers, limits)
    return not any(out_of_limits(excess) for key, excess in by_other.items() if _compares(key, one, other))


def _compares(key: Key, one: Firmware, other: Firmware) -> bool:
    experiment, metric, _ = key
    if experiment in OF_THE_TEXT or (experiment, metric) in OF_THE_MAP:
        return False
    return one.settings == other.settings or (experiment, metric) not in OF_THE_TORQUE


def _changed(one: Firmware, other: Firmware) -> Collection[str]:
    """Return the subjects that one version moves otherwise than another."""
    if None in (one.settings, other.settings):
        return (*(channel.label for channel in Channel), "hand")
    return [channel.label for channel in SHIFT_CLOSING] if one.calibrations != other.calibrations else []


def _shifts(version: str) -> bool:
    """Return whether a version moves windows when it homes; one that was not homed has those of an older version."""
    return len(firmware_of(version).calibrations) > 1


def _alike(version: str) -> str:
    """Return the versions that move as this one, in words."""
    first, *rest = next(group for group in ALIKE if version in group)
    return f"{first} or {rest[-1]}" if len(rest) == 1 else f"{first} to {rest[-1]}" if rest else first
