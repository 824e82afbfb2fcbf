"""Every way to write down a posture, and the conversion between any two; in the units that people read.

A table of representations around the travel: each says how its values become travel and how travel becomes them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.actuation import stages
from aero.actuation.arrays import finite_numbers
from aero.actuation.coefficients import load_coefficients
from aero.actuation.map import ActuationMap
from aero.channels import JOINT_BOX_RAD, Channel, Joint
from aero.protocol import MAX_CODE

# `aero-open-sdk` 0.1.0.dev1 clamps joints in silence, normalises by typed-in limits that differ from the excursions by
# up to 0.037° on the fingers, and truncates; it knows no shifted window. `ActuationMap` rounds, and refuses what is out
# of range.
SDK_LIMITS_DEG = np.array(
    [
        [0.0, 288.1603],
        [0.0, 288.1603],
        [0.0, 288.1603],
        [0.0, 288.1603],
        [0.0, 100.0],
        [0.0, 104.1250],
        [-15.2789, 247.1500],
    ]
)
SDK_LIMITS_DEG.flags.writeable = False
"""Shaft angles that the SDK takes for codes 0 and 65535, (7, 2) float, degrees, command order."""


def sdk_codes_from_joints(joints_deg: ArrayLike) -> NDArray[np.uint16]:
    """Return the codes (..., 7), uint16, that the SDK sends for postures (..., 16) in degrees and the order of `Joint`.

    Degrees in, because the SDK works in them and truncation shows the last bit of a rounding.
    """
    low, high = np.rad2deg(JOINT_BOX_RAD).T
    paper = load_coefficients("paper")
    joints = finite_numbers(joints_deg, len(Joint), "joints")
    travel = stages.travel_from_joints(paper, np.clip(joints, low, high))
    return sdk_codes_from_angles(stages.angles_from_travel(paper, travel))


def sdk_codes_from_angles(angles_deg: ArrayLike) -> NDArray[np.uint16]:
    """Return the codes (..., 7), uint16, that the SDK sends for shaft angles (..., 7) in degrees; clamps as it does."""
    low, high = SDK_LIMITS_DEG.T
    angles = np.clip(finite_numbers(angles_deg, len(Channel), "shaft angles"), low, high)
    codes: NDArray[np.uint16] = ((angles - low) / (high - low) * MAX_CODE).astype(np.uint16)
    return codes


Values = NDArray[np.float64]
ToTravel = Callable[[ActuationMap, Values], Values]
FromTravel = Callable[[ActuationMap, Values], Values]

_CHANNEL_LABELS = tuple(channel.label for channel in Channel)
_JOINT_LABELS = tuple(joint.label for joint in Joint)


@dataclass(frozen=True)
class Representation:
    """One way to write down a posture."""

    labels: tuple[str, ...]
    """What the entries are called, in their order."""
    units: tuple[str, ...]
    """Unit of each entry."""
    to_travel: ToTravel | None
    """From these values to travel in SI units, None where there is no way back."""
    from_travel: FromTravel
    """From travel in SI units to these values."""


@dataclass(frozen=True)
class Conversion:
    """A converted posture."""

    values: NDArray[np.float64]
    """(..., n) in the target's units."""
    saturated: NDArray[np.bool_]
    """(..., 7) channels that were brought into the command window; all False unless that was asked for."""


def convert(codec: ActuationMap, values: ArrayLike, source: str, target: str, *, saturate: bool = False) -> Conversion:
    """Convert postures (..., n) between two of `REPRESENTATIONS`.

    Joints are reached from anything else as the compact posture, because seven cables do not tell sixteen joints.

    Args:
        codec: the map.
        values: (..., n) in the units of `source`.
        source: name of the representation that `values` are in.
        target: name of the one wanted.
        saturate: bring shaft angles outside the command window to its ends instead of refusing them.

    Raises:
        ValueError: an unknown representation, one that cannot be converted from, a wrong shape, a number that is not
            finite, or, without `saturate`, a posture outside the command window where codes or counts are wanted.
    """
    for name in (source, target):
        if name not in REPRESENTATIONS:
            raise ValueError(f"unknown representation {name!r}; known are {', '.join(REPRESENTATIONS)}")
    to_travel = REPRESENTATIONS[source].to_travel
    if to_travel is None:
        raise ValueError(f"nothing can be converted from {source!r}")
    given = finite_numbers(values, len(REPRESENTATIONS[source].labels), source)
    saturated = np.zeros((*given.shape[:-1], len(Channel)), np.bool_)
    if source == target:
        return Conversion(given, saturated)
    travel = to_travel(codec, given)
    if saturate:
        codes, saturated = codec.saturating_codes(codec.angles_from_travel(travel))
        ends = codec.travel_from_angles(codec.angles_from_codes(codes))
        travel = np.where(saturated, ends, travel)
    return Conversion(REPRESENTATIONS[target].from_travel(codec, travel), saturated)


def _codes(codec: ActuationMap, travel: Values) -> Values:
    codes: Values = codec.codes_from_angles(codec.angles_from_travel(travel)).astype(np.float64)
    return codes


def _travel_from_codes(codec: ActuationMap, codes: Values) -> Values:
    whole = np.rint(codes).astype(np.int64)
    if (whole != codes).any():
        raise ValueError(f"codes: expected whole numbers, got {codes.tolist()}")
    travel: Values = codec.travel_from_angles(codec.angles_from_codes(whole))
    return travel


def _counts(codec: ActuationMap, travel: Values) -> Values:
    return codec.window.counts_from_codes(_codes(codec, travel).astype(np.int64)).astype(np.float64)


def _travel_from_counts(codec: ActuationMap, counts: Values) -> Values:
    return _travel_from_codes(codec, codec.window.codes_from_counts(counts).astype(np.float64))


def _millimetres(travel: Values) -> Values:
    """Scale travel from m and rad to mm and degrees."""
    scaled = travel * 1e3
    scaled[..., Channel.THUMB_ABDUCTION] = np.rad2deg(travel[..., Channel.THUMB_ABDUCTION])
    return scaled


def _metres(travel: Values) -> Values:
    scaled = travel * 1e-3
    scaled[..., Channel.THUMB_ABDUCTION] = np.deg2rad(travel[..., Channel.THUMB_ABDUCTION])
    return scaled


def _cables(unit: str, abduction_unit: str) -> tuple[str, ...]:
    return tuple(abduction_unit if channel == Channel.THUMB_ABDUCTION else unit for channel in Channel)


REPRESENTATIONS: dict[str, Representation] = {
    "joints": Representation(
        _JOINT_LABELS,
        ("deg",) * len(Joint),
        lambda codec, joints: codec.travel_from_joints(np.deg2rad(joints)),
        lambda codec, travel: np.rad2deg(codec.joints_from_compact(codec.compact_from_travel(travel))),
    ),
    "compact": Representation(
        _CHANNEL_LABELS,
        ("deg",) * len(Channel),
        lambda codec, compact: codec.travel_from_joints(codec.joints_from_compact(np.deg2rad(compact))),
        lambda codec, travel: np.rad2deg(codec.compact_from_travel(travel)),
    ),
    "lengths": Representation(
        _CHANNEL_LABELS,
        _cables("m", "rad"),
        lambda codec, lengths: codec.travel_from_lengths(lengths),
        lambda codec, travel: codec.lengths_from_travel(travel),
    ),
    "travel": Representation(
        _CHANNEL_LABELS,
        _cables("mm", "deg"),
        lambda _, travel: _metres(travel),
        lambda _, travel: _millimetres(travel),
    ),
    "angles": Representation(
        _CHANNEL_LABELS,
        ("deg",) * len(Channel),
        lambda codec, angles: codec.travel_from_angles(np.deg2rad(angles)),
        lambda codec, travel: np.rad2deg(codec.angles_from_travel(travel)),
    ),
    "codes": Representation(_CHANNEL_LABELS, ("1/65535",) * len(Channel), _travel_from_codes, _codes),
    "counts": Representation(_CHANNEL_LABELS, ("count",) * len(Channel), _travel_from_counts, _counts),
    "sdk-codes": Representation(
        _CHANNEL_LABELS,
        ("1/65535",) * len(Channel),
        None,
        lambda codec, travel: sdk_codes_from_angles(np.rad2deg(codec.angles_from_travel(travel))).astype(np.float64),
    ),
}
"""Name to representation. `lengths` are the simulator's commands, `angles` the shafts', `counts` the servos' encoder
counts in the map's window, `sdk-codes` what the vendor's SDK would send, clamped and truncated as it does."""
