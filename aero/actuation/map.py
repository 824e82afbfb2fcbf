"""Actuation map: conversions between postures, lengths, cable travel, shaft angles and codes.

    joints (16) ─────────► travel (7) ◄───► shaft angles (7) ◄───► codes (7)
    compact (7) ─► joints    │    ▲
    compact ◄────────────────┤    │
    lengths (7) ◄────────────┘    └──── lengths

All conversions pass through the travel, so one path joins any two representations. Every stage is linear or affine
(paper, chapter 4); equation names are the labels in the paper's source.
"""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from aero.actuation.arrays import Array, as_codes, as_finite, as_floats, namespace
from aero.actuation.coefficients import Coefficients, load_coefficients
from aero.actuation.window import UNSHIFTED, CommandWindow
from aero.channels import JOINT_BOX_RAD, Channel, Joint
from aero.protocol import MAX_CODE

_CHANNELS = len(Channel)
_JOINTS = len(Joint)
_FINGERS = slice(Channel.INDEX, Channel.THUMB_ABDUCTION)
_FINGER_JOINTS = slice(Joint.INDEX_MCP, Joint.THUMB_ABDUCTION)

_CHANNEL_OF_JOINT = np.array([*np.repeat(range(4), 3), 4, 5, 6, 6])
"""Index into a compact posture for each of the sixteen joints."""


class SaturatedCodes(NamedTuple):
    """Codes clipped to their range, and a mask of the clipped ones."""

    codes: Array
    """(..., 7) uint16."""
    saturated: Array
    """(..., 7) bool, True for an angle outside the window or NaN; the code of a NaN is meaningless."""


@dataclass(frozen=True)
class ActuationMap:
    """Converts between simulator lengths, postures, cable travel, shaft angles and position codes, in command order.

    Representations, all (..., n) over any leading axes:

    - `joints` (16), rad, in the order of `Joint`; `compact` (7), rad, one angle for all joints on a cable
    - `lengths` (7), the simulator's commands and sensors: cables in m (longer is more open), abduction in rad
    - `travel` (7), cable taken up from the extended hand, m; abduction in rad
    - `angles` (7), shaft rotation from the extended hand, rad
    - `codes` (7), 0..65535 over the command window; the only ones that depend on the firmware

    Arguments are lists, NumPy arrays, or arrays of another library that follows the array API; results are of the
    argument's library. Inside a JAX trace use `saturating_codes`, because `codes_from_angles` must inspect values to
    raise. Every conversion raises a ValueError for NaN or infinity in a NumPy array or a list.
    """

    coefficients: Coefficients = field(default_factory=lambda: load_coefficients("paper"))
    window: CommandWindow = UNSHIFTED

    @classmethod
    def for_firmware(
        cls,
        version: str,
        calibration: str | None = None,
        *,
        side: str = "right",
        coefficients: str | Path = "paper",
    ) -> Self:
        """Return the map for a firmware; see `CommandWindow.for_firmware` and `load_coefficients`."""
        return cls(load_coefficients(coefficients), CommandWindow.for_firmware(version, calibration, side))

    @cached_property
    def winding_matrix(self) -> NDArray[np.float64]:
        """Matrix A in `d = A q`, (7, 16) float, m/rad; the row of abduction rad/rad."""
        return _constant(self.travel_from_joints(np.eye(_JOINTS)).T)

    @cached_property
    def excursion_rad(self) -> NDArray[np.float64]:
        """Shaft angles that the joint box allows, (7, 2) float, rad; eq. (actrange). The flexor's lower is negative.

        A linear form over a box is extreme at the corner chosen by the signs of its coefficients.
        """
        at_limits = self.winding_matrix[:, :, np.newaxis] * JOINT_BOX_RAD
        travel = np.stack([at_limits.min(axis=2).sum(axis=1), at_limits.max(axis=2).sum(axis=1)])
        return _constant(self.angles_from_travel(travel).T)

    @cached_property
    def window_rad(self) -> NDArray[np.float64]:
        """Shaft angles of codes 0 and 65535, (7, 2) float, rad."""
        return _constant(self.excursion_rad + self.window.shifts_rad())

    def travel_from_joints(self, joints: Array) -> Array:
        """Return the travel `d = A q` of postures (..., 16); eqs. (fingermap), (thumbcmc), (thumbflexor)."""
        joints = as_finite(joints, _JOINTS, "joints")
        xp = namespace(joints)
        finger_joints = xp.reshape(joints[..., _FINGER_JOINTS], (*joints.shape[:-1], 4, 3))
        mcp, pip, dip = self.coefficients.finger_winding
        fingers = mcp * finger_joints[..., 0] + pip * finger_joints[..., 1] + dip * finger_joints[..., 2]
        thumb = _thumb_travel(
            self.coefficients,
            joints[..., Joint.THUMB_ABDUCTION],
            joints[..., Joint.THUMB_CMC],
            joints[..., Joint.THUMB_MCP],
            joints[..., Joint.THUMB_IP],
        )
        return xp.concat([fingers, thumb], axis=-1)

    def joints_from_compact(self, compact: Array) -> Array:
        """Return the postures (..., 16) of compact postures (..., 7): all joints on a cable take its angle."""
        compact = as_finite(compact, _CHANNELS, "compact posture")
        xp = namespace(compact)
        return xp.take(compact, xp.asarray(_CHANNEL_OF_JOINT), axis=-1)

    def compact_from_travel(self, travel: Array) -> Array:
        """Return the compact postures (..., 7) of travels (..., 7); inverts `A` restricted to compact postures."""
        travel = as_finite(travel, _CHANNELS, "travel")
        xp = namespace(travel)
        (cmc_abd, cmc_cmc, cmc_mcp, cmc_ip), (flex_abd, flex_cmc, flex_mcp, flex_ip) = self.coefficients.thumb_winding
        cmc_distal, flex_distal = cmc_mcp + cmc_ip, flex_mcp + flex_ip
        abduction = travel[..., Channel.THUMB_ABDUCTION]
        cmc_rest = travel[..., Channel.THUMB_CMC_FLEXION] - cmc_abd * abduction
        flex_rest = travel[..., Channel.THUMB_FLEXOR] - flex_abd * abduction
        determinant = cmc_cmc * flex_distal - cmc_distal * flex_cmc
        cmc = (flex_distal * cmc_rest - cmc_distal * flex_rest) / determinant
        distal = (cmc_cmc * flex_rest - flex_cmc * cmc_rest) / determinant
        fingers = travel[..., _FINGERS] / sum(self.coefficients.finger_winding)
        return xp.concat([fingers, xp.stack([abduction, cmc, distal], axis=-1)], axis=-1)

    def thumb_joints_from_lengths(self, lengths: Array) -> Array:
        """Estimate the thumb's flexion angles (..., 3), CMC, MCP and IP, rad, from lengths (..., 7); eq. (thumbfit)."""
        lengths = as_finite(lengths, _CHANNELS, "lengths")
        return namespace(lengths).stack(_thumb_flexion(self.coefficients, *_thumb_columns(lengths)), axis=-1)

    def travel_from_lengths(self, lengths: Array) -> Array:
        """Return the travels (..., 7) that the hand needs for simulator lengths (..., 7).

        Fingers map one interval onto the other, eq. (servomap); the thumb uses its estimated joints, eq. (thumbfit).
        """
        lengths = as_finite(lengths, _CHANNELS, "lengths")
        xp = namespace(lengths)
        longest = xp.asarray([longest for _, longest in self.coefficients.finger_lengths], dtype=lengths.dtype)
        fingers = (longest - lengths[..., _FINGERS]) * xp.asarray(_finger_gain(self.coefficients), dtype=lengths.dtype)
        abduction, *cables = _thumb_columns(lengths)
        thumb = _thumb_travel(self.coefficients, abduction, *_thumb_flexion(self.coefficients, abduction, *cables))
        return xp.concat([fingers, thumb], axis=-1)

    def lengths_from_travel(self, travel: Array) -> Array:
        """Return the simulator lengths (..., 7) of the hand's travels (..., 7); eqs. (servomap) and (thumbinv)."""
        travel = as_finite(travel, _CHANNELS, "travel")
        xp = namespace(travel)
        longest = xp.asarray([longest for _, longest in self.coefficients.finger_lengths], dtype=travel.dtype)
        fingers = longest - travel[..., _FINGERS] / xp.asarray(_finger_gain(self.coefficients), dtype=travel.dtype)
        abduction = travel[..., Channel.THUMB_ABDUCTION]
        cables = [
            (travel[..., channel] - offset - winding[0] * abduction) / gain
            for channel, gain, offset, winding in zip(
                (Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR),
                self.coefficients.thumb_gain,
                self.coefficients.thumb_offset,
                self.coefficients.thumb_winding,
                strict=True,
            )
        ]
        return xp.concat([fingers, xp.stack([abduction, *cables], axis=-1)], axis=-1)

    def angles_from_travel(self, travel: Array) -> Array:
        """Return the shaft angles (..., 7), rad, of travels (..., 7); eq. (spool), abduction's shaft is its joint."""
        travel = as_finite(travel, _CHANNELS, "travel")
        return travel / _travel_per_angle(self.coefficients, travel)

    def travel_from_angles(self, angles: Array) -> Array:
        """Return the travels (..., 7) of shaft angles (..., 7), rad; eq. (inversechain)."""
        angles = as_finite(angles, _CHANNELS, "angles")
        return angles * _travel_per_angle(self.coefficients, angles)

    def codes_from_angles(self, angles: Array) -> Array:
        """Return codes (..., 7), uint16, rounded to nearest, of shaft angles (..., 7); eq. (motormap).

        Raises:
            ValueError: NaN, infinity, or an angle outside the window by more than half a code.
        """
        rounded, inside = self._rounded_codes(angles)
        xp = namespace(rounded)
        if not bool(xp.all(inside)):
            raise ValueError(self._outside(np.asarray(angles, np.float64), np.asarray(inside)))
        return xp.astype(rounded, xp.uint16)

    def saturating_codes(self, angles: Array) -> SaturatedCodes:
        """Return codes of shaft angles (..., 7), clipped to the window, with the mask of the clipped ones.

        Raises:
            ValueError: NaN or infinity in a NumPy array; a JAX trace cannot raise.
        """
        rounded, inside = self._rounded_codes(angles)
        if isinstance(rounded, np.ndarray) and not np.isfinite(rounded).all():
            raise ValueError(f"shaft angles must be finite, got {np.asarray(angles)}")
        xp = namespace(rounded)
        return SaturatedCodes(xp.astype(xp.clip(rounded, 0, MAX_CODE), xp.uint16), ~inside)

    def angles_from_codes(self, codes: Array) -> Array:
        """Return shaft angles (..., 7) of codes (..., 7); eq. (inversechain).

        Raises:
            ValueError: not integers, or out of 0..65535.
        """
        codes = as_codes(codes, _CHANNELS, "codes")
        xp = namespace(codes)
        low, high = self._window_like(xp, None)
        return low + xp.astype(codes, low.dtype) * ((high - low) / MAX_CODE)

    def codes_from_lengths(self, lengths: Array) -> Array:
        """Return codes for simulator lengths (..., 7), as in a policy's command. Raises as `codes_from_angles`."""
        return self.codes_from_angles(self.angles_from_travel(self.travel_from_lengths(lengths)))

    def lengths_from_codes(self, codes: Array) -> Array:
        """Return simulator lengths of codes (..., 7), as in an observation. Raises as `angles_from_codes`."""
        return self.lengths_from_travel(self.travel_from_angles(self.angles_from_codes(codes)))

    def codes_from_joints(self, joints: Array) -> Array:
        """Return codes for postures (..., 16). Raises as `codes_from_angles`."""
        return self.codes_from_angles(self.angles_from_travel(self.travel_from_joints(joints)))

    def codes_from_compact(self, compact: Array) -> Array:
        """Return codes for compact postures (..., 7). Raises as `codes_from_angles`."""
        return self.codes_from_joints(self.joints_from_compact(compact))

    def compact_from_codes(self, codes: Array) -> Array:
        """Return the compact postures of codes (..., 7). Raises as `angles_from_codes`."""
        return self.compact_from_travel(self.travel_from_angles(self.angles_from_codes(codes)))

    def _rounded_codes(self, angles: Array) -> tuple[Array, Array]:
        angles = as_floats(angles, _CHANNELS, "shaft angles")
        xp = namespace(angles)
        low, high = self._window_like(xp, angles.dtype)
        rounded = xp.round((angles - low) * (MAX_CODE / (high - low)))
        return rounded, (rounded >= 0) & (rounded <= MAX_CODE)

    def _window_like(self, xp: Array, dtype: Array) -> tuple[Array, Array]:
        low, high = self.window_rad.T
        return xp.asarray(low, dtype=dtype), xp.asarray(high, dtype=dtype)

    def _outside(self, angles: NDArray[np.float64], inside: NDArray[np.bool_]) -> str:
        rows_angles, rows_inside = angles.reshape(-1, _CHANNELS), inside.reshape(-1, _CHANNELS)
        lines = []
        for channel in Channel:
            offenders = rows_angles[~rows_inside[:, channel], channel]
            if offenders.size:
                low, high = np.rad2deg(self.window_rad[channel])
                shown = ", ".join(f"{angle:.2f}" for angle in np.rad2deg(offenders[:3]))
                lines.append(f"{channel.label} at {shown}° ({offenders.size} in all), window {low:.2f}..{high:.2f}°")
        return (
            f"shaft angles outside the command window {self.window.name!r}: {'; '.join(lines)}. Stay inside, or choose "
            "saturation (saturating_codes; --saturate on the command line)."
        )


def _constant(array: NDArray[np.float64]) -> NDArray[np.float64]:
    array.flags.writeable = False
    return array


def _thumb_columns(values: Array) -> tuple[Array, Array, Array]:
    """Return copies of the thumb's channels of values (..., 7); a strided view of one costs as much as all seven."""
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
    """Return travel on the hand per simulator length, m/m: the ratio of the joint-box stroke to the cable stroke."""
    shortest_stroke, longest_stroke = JOINT_BOX_RAD[: len(coefficients.finger_winding)].T
    stroke = float(np.dot(coefficients.finger_winding, longest_stroke - shortest_stroke))
    return [stroke / (longest - shortest) for shortest, longest in coefficients.finger_lengths]


def _travel_per_angle(coefficients: Coefficients, like: Array) -> Array:
    radii = [coefficients.spool_radius] * _CHANNELS
    radii[Channel.THUMB_ABDUCTION] = 1.0
    return namespace(like).asarray(radii, dtype=like.dtype)
