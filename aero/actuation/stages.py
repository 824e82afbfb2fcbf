"""The map's stages, each a pure function over the last axis of an array; all are linear or affine (paper, chapter 4).

    joints (16) ─────────► travel (7) ◄───► shaft angles (7) ◄───► codes (7)
    compact (7) ─► joints    │    ▲
    compact ◄────────────────┤    │
    lengths (7) ◄────────────┘    └──── lengths

Everything meets in the travel, so any two representations are joined by one path. Shapes are (..., n); lengths and
travels are in m, abduction's entry of both and every angle in rad. Equation names are the labels in the paper's source.
"""

from __future__ import annotations

import numpy as np

from aero.actuation.arrays import Array, as_finite, namespace
from aero.actuation.coefficients import Coefficients
from aero.channels import JOINT_BOX_RAD, Channel, Joint

_CHANNELS = len(Channel)
_JOINTS = len(Joint)
_FINGERS = slice(Channel.INDEX, Channel.THUMB_ABDUCTION)
_FINGER_JOINTS = slice(Joint.INDEX_MCP, Joint.THUMB_ABDUCTION)

_CHANNEL_OF_JOINT = np.array([*np.repeat(range(4), 3), 4, 5, 6, 6])
"""Which entry of a compact posture each of the sixteen joints takes."""


def travel_from_joints(coefficients: Coefficients, joints: Array) -> Array:
    """Return the travel `d = A q` of postures (..., 16); eqs. (fingermap), (thumbcmc), (thumbflexor)."""
    joints = as_finite(joints, _JOINTS, "joints")
    xp = namespace(joints)
    finger_joints = xp.reshape(joints[..., _FINGER_JOINTS], (*joints.shape[:-1], 4, 3))
    mcp, pip, dip = coefficients.finger_winding
    fingers = mcp * finger_joints[..., 0] + pip * finger_joints[..., 1] + dip * finger_joints[..., 2]
    thumb = _thumb_travel(
        coefficients,
        joints[..., Joint.THUMB_ABDUCTION],
        joints[..., Joint.THUMB_CMC],
        joints[..., Joint.THUMB_MCP],
        joints[..., Joint.THUMB_IP],
    )
    return xp.concat([fingers, thumb], axis=-1)


def joints_from_compact(compact: Array) -> Array:
    """Return the postures (..., 16) of compact ones (..., 7), in which the joints on one cable have one angle."""
    compact = as_finite(compact, _CHANNELS, "compact posture")
    xp = namespace(compact)
    return xp.take(compact, xp.asarray(_CHANNEL_OF_JOINT), axis=-1)


def compact_from_travel(coefficients: Coefficients, travel: Array) -> Array:
    """Return the compact postures (..., 7) that have the given travels; inverts `A` on the compact section."""
    travel = as_finite(travel, _CHANNELS, "travel")
    xp = namespace(travel)
    (cmc_abd, cmc_cmc, cmc_mcp, cmc_ip), (flex_abd, flex_cmc, flex_mcp, flex_ip) = coefficients.thumb_winding
    cmc_distal, flex_distal = cmc_mcp + cmc_ip, flex_mcp + flex_ip
    abduction = travel[..., Channel.THUMB_ABDUCTION]
    cmc_rest = travel[..., Channel.THUMB_CMC_FLEXION] - cmc_abd * abduction
    flex_rest = travel[..., Channel.THUMB_FLEXOR] - flex_abd * abduction
    determinant = cmc_cmc * flex_distal - cmc_distal * flex_cmc
    cmc = (flex_distal * cmc_rest - cmc_distal * flex_rest) / determinant
    distal = (cmc_cmc * flex_rest - flex_cmc * cmc_rest) / determinant
    fingers = travel[..., _FINGERS] / sum(coefficients.finger_winding)
    return xp.concat([fingers, xp.stack([abduction, cmc, distal], axis=-1)], axis=-1)


def thumb_joints_from_lengths(coefficients: Coefficients, lengths: Array) -> Array:
    """Estimate the thumb's flexion angles (..., 3), CMC, MCP and IP, rad, from lengths (..., 7); eq. (thumbfit)."""
    lengths = as_finite(lengths, _CHANNELS, "lengths")
    return namespace(lengths).stack(_thumb_flexion(coefficients, *_thumb_columns(lengths)), axis=-1)


def travel_from_lengths(coefficients: Coefficients, lengths: Array) -> Array:
    """Return the travels (..., 7) that the hand needs for simulator lengths (..., 7).

    Fingers by matching intervals, eq. (servomap); the thumb's cables by way of its estimated joints, eq. (thumbfit).
    """
    lengths = as_finite(lengths, _CHANNELS, "lengths")
    xp = namespace(lengths)
    longest = xp.asarray([longest for _, longest in coefficients.finger_lengths], dtype=lengths.dtype)
    fingers = (longest - lengths[..., _FINGERS]) * xp.asarray(_finger_gain(coefficients), dtype=lengths.dtype)
    abduction, *cables = _thumb_columns(lengths)
    thumb = _thumb_travel(coefficients, abduction, *_thumb_flexion(coefficients, abduction, *cables))
    return xp.concat([fingers, thumb], axis=-1)


def lengths_from_travel(coefficients: Coefficients, travel: Array) -> Array:
    """Return the simulator lengths (..., 7) of the hand's travels (..., 7); eqs. (servomap) and (thumbinv)."""
    travel = as_finite(travel, _CHANNELS, "travel")
    xp = namespace(travel)
    longest = xp.asarray([longest for _, longest in coefficients.finger_lengths], dtype=travel.dtype)
    fingers = longest - travel[..., _FINGERS] / xp.asarray(_finger_gain(coefficients), dtype=travel.dtype)
    abduction = travel[..., Channel.THUMB_ABDUCTION]
    cables = [
        (travel[..., channel] - offset - winding[0] * abduction) / gain
        for channel, gain, offset, winding in zip(
            (Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR),
            coefficients.thumb_gain,
            coefficients.thumb_offset,
            coefficients.thumb_winding,
            strict=True,
        )
    ]
    return xp.concat([fingers, xp.stack([abduction, *cables], axis=-1)], axis=-1)


def angles_from_travel(coefficients: Coefficients, travel: Array) -> Array:
    """Return the shaft angles (..., 7), rad, of travels (..., 7); eq. (spool), abduction's shaft is its joint."""
    travel = as_finite(travel, _CHANNELS, "travel")
    return travel / _travel_per_angle(coefficients, travel)


def travel_from_angles(coefficients: Coefficients, angles: Array) -> Array:
    """Return the travels (..., 7) of shaft angles (..., 7), rad; eq. (inversechain)."""
    angles = as_finite(angles, _CHANNELS, "angles")
    return angles * _travel_per_angle(coefficients, angles)


def winding_matrix(coefficients: Coefficients) -> Array:
    """Return A, (7, 16) float, m/rad (abduction's row rad/rad): the travel of each joint's unit angle."""
    return travel_from_joints(coefficients, np.eye(_JOINTS)).T


def excursion_rad(coefficients: Coefficients) -> Array:
    """Return the least and greatest shaft angle of each channel over the joint box, (7, 2) float, rad; eq. (actrange).

    A linear form over a box is extreme where each joint sits on the limit that the sign of its entry asks for.
    """
    at_limits = winding_matrix(coefficients)[:, :, np.newaxis] * JOINT_BOX_RAD
    travel = np.stack([at_limits.min(axis=2).sum(axis=1), at_limits.max(axis=2).sum(axis=1)])
    return angles_from_travel(coefficients, travel).T


def _thumb_columns(values: Array) -> tuple[Array, Array, Array]:
    """Return the thumb's channels of values (..., 7), copied: reading one in place costs as much as reading all."""
    xp = namespace(values)
    abduction, cmc, flexor = (
        xp.asarray(values[..., channel], copy=True)
        for channel in (Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR)
    )
    return abduction, cmc, flexor


def _thumb_flexion(coefficients: Coefficients, abduction: Array, cmc_cable: Array, flexor_cable: Array) -> list[Array]:
    return [
        per_abduction * abduction + per_cmc_cable * cmc_cable + per_flexor_cable * flexor_cable + constant
        for per_abduction, per_cmc_cable, per_flexor_cable, constant in coefficients.thumb_regression
    ]


def _thumb_travel(coefficients: Coefficients, abduction: Array, cmc: Array, mcp: Array, ip: Array) -> Array:
    cables = [
        per_abduction * abduction + per_cmc * cmc + per_mcp * mcp + per_ip * ip
        for per_abduction, per_cmc, per_mcp, per_ip in coefficients.thumb_winding
    ]
    return namespace(abduction).stack([abduction, *cables], axis=-1)


def _finger_gain(coefficients: Coefficients) -> list[float]:
    """Travel on the hand per length in the simulator: both intervals describe the same stroke."""
    shortest_stroke, longest_stroke = JOINT_BOX_RAD[: len(coefficients.finger_winding)].T
    stroke = float(np.dot(coefficients.finger_winding, longest_stroke - shortest_stroke))
    return [stroke / (longest - shortest) for shortest, longest in coefficients.finger_lengths]


def _travel_per_angle(coefficients: Coefficients, like: Array) -> Array:
    radii = [coefficients.spool_radius] * _CHANNELS
    radii[Channel.THUMB_ABDUCTION] = 1.0
    return namespace(like).asarray(radii, dtype=like.dtype)
