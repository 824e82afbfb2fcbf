"""The actuation map: one set of coefficients and one command window, and every conversion between them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from aero.actuation import stages
from aero.actuation.arrays import Array, as_codes, as_floats, namespace
from aero.actuation.coefficients import Coefficients, load_coefficients
from aero.actuation.window import UNSHIFTED, CommandWindow
from aero.channels import Channel
from aero.errors import WindowMismatchError
from aero.protocol import MAX_CODE


class SaturatedCodes(NamedTuple):
    """Codes that were brought into range, and which ones had to be."""

    codes: Array
    """(..., 7) uint16."""
    saturated: Array
    """(..., 7) bool, True where the asked angle lay outside the window or was NaN; a NaN's code means nothing."""


@dataclass(frozen=True)
class ActuationMap:
    """Converts between simulator lengths, postures, cable travel, shaft angles and position codes, in command order.

    Representations, all (..., n) over any leading axes:

    - `joints` (16), rad, in the order of `Joint`; `compact` (7), rad, one angle for all joints on a cable
    - `lengths` (7), the simulator's commands and sensors: cables in m (longer is more open), abduction in rad
    - `travel` (7), cable taken up from the extended hand, m; abduction in rad
    - `angles` (7), shaft rotation from the extended hand, rad
    - `codes` (7), 0..65535 over the command window; the only ones that depend on the firmware

    Arguments are NumPy arrays, lists, or arrays of another library that follows the array API, which then also
    is what comes back; inside a JAX trace use `saturating_codes`, because `codes_from_angles` must look at values to
    raise. Every conversion raises a ValueError for NaN or infinity in a NumPy array or a list.
    """

    coefficients: Coefficients = field(default_factory=lambda: load_coefficients("paper"))
    """The numbers of the map."""
    window: CommandWindow = UNSHIFTED
    """What the hand's firmware makes of a code."""

    @classmethod
    def for_firmware(
        cls,
        version: str,
        calibration: str | None = None,
        *,
        hand: str = "right",
        coefficients: str | Path = "paper",
    ) -> Self:
        """Return the map for a firmware; see `CommandWindow.for_firmware` and `load_coefficients`."""
        return cls(load_coefficients(coefficients), CommandWindow.for_firmware(version, calibration, hand))

    def describe(self) -> str:
        """Say in one line which coefficients and which window this is."""
        ends = ", ".join(
            f"{channel.label} {low:.2f}..{high:.2f}°"
            for channel, (low, high) in zip(Channel, np.rad2deg(self.window_rad), strict=True)
        )
        window = f"window {self.window.name!r} of a {self.window.hand} hand"
        return f"coefficients {self.coefficients.name!r}, {window}: {ends}"

    @cached_property
    def winding_matrix(self) -> NDArray[np.float64]:
        """A in `d = A q`, (7, 16) float, m/rad; abduction's row rad/rad."""
        return _constant(stages.winding_matrix(self.coefficients))

    @cached_property
    def excursion_rad(self) -> NDArray[np.float64]:
        """Shaft angles that the joint box allows, (7, 2) float, rad; the flexor's lower one is negative."""
        return _constant(stages.excursion_rad(self.coefficients))

    @cached_property
    def window_rad(self) -> NDArray[np.float64]:
        """Shaft angles of codes 0 and 65535, (7, 2) float, rad."""
        return _constant(self.excursion_rad + self.window.shifts_rad())

    def require_window(self, firmware_window: CommandWindow) -> None:
        """Check that the map was made for the window that a hand's firmware uses.

        Raises:
            WindowMismatchError: a channel would end at another angle; the message names it, the error and the remedy.
        """
        off = np.rad2deg(firmware_window.shifts_rad() - self.window.shifts_rad())
        wrong = [c for c in Channel if np.any(off[c] != 0.0)]
        if wrong:
            errors = "; ".join(f"{c.label} {off[c][0]:+.2f}° open, {off[c][1]:+.2f}° closed" for c in wrong)
            raise WindowMismatchError(
                f"the map is for window {self.window.name!r}, the hand's is {firmware_window.name!r}, so shafts would "
                f"stop off target by: {errors} (positive: too far closed). Use ActuationMap.for_firmware with the "
                "hand's firmware version and calibration."
            )

    def travel_from_joints(self, joints: Array) -> Array:
        """Return travel (..., 7) of postures (..., 16)."""
        return stages.travel_from_joints(self.coefficients, joints)

    def joints_from_compact(self, compact: Array) -> Array:
        """Return postures (..., 16) of compact ones (..., 7)."""
        return stages.joints_from_compact(compact)

    def compact_from_travel(self, travel: Array) -> Array:
        """Return the compact postures (..., 7) with the given travel (..., 7)."""
        return stages.compact_from_travel(self.coefficients, travel)

    def travel_from_lengths(self, lengths: Array) -> Array:
        """Return travel (..., 7) on the hand for simulator lengths (..., 7)."""
        return stages.travel_from_lengths(self.coefficients, lengths)

    def lengths_from_travel(self, travel: Array) -> Array:
        """Return simulator lengths (..., 7) for travel (..., 7) on the hand."""
        return stages.lengths_from_travel(self.coefficients, travel)

    def angles_from_travel(self, travel: Array) -> Array:
        """Return shaft angles (..., 7) of travel (..., 7)."""
        return stages.angles_from_travel(self.coefficients, travel)

    def travel_from_angles(self, angles: Array) -> Array:
        """Return travel (..., 7) of shaft angles (..., 7)."""
        return stages.travel_from_angles(self.coefficients, angles)

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
        """Return codes of shaft angles (..., 7), those outside the window at its ends, and which ones these are.

        Raises:
            ValueError: NaN or infinity in a NumPy array; in a trace nothing can be raised.
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
        codes = as_codes(codes, len(Channel), "codes")
        xp = namespace(codes)
        low, high = self._window_like(xp, None)
        return low + xp.astype(codes, low.dtype) * ((high - low) / MAX_CODE)

    def codes_from_lengths(self, lengths: Array) -> Array:
        """Return codes for simulator lengths (..., 7); the way of a policy's command. Raises as `codes_from_angles`."""
        return self.codes_from_angles(self.angles_from_travel(self.travel_from_lengths(lengths)))

    def lengths_from_codes(self, codes: Array) -> Array:
        """Return simulator lengths for codes (..., 7); the way of an observation. Raises as `angles_from_codes`."""
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
        angles = as_floats(angles, len(Channel), "shaft angles")
        xp = namespace(angles)
        low, high = self._window_like(xp, angles.dtype)
        rounded = xp.round((angles - low) * (MAX_CODE / (high - low)))
        return rounded, (rounded >= 0) & (rounded <= MAX_CODE)

    def _window_like(self, xp: Array, dtype: Array) -> tuple[Array, Array]:
        low, high = self.window_rad.T
        return xp.asarray(low, dtype=dtype), xp.asarray(high, dtype=dtype)

    def _outside(self, angles: NDArray[np.float64], inside: NDArray[np.bool_]) -> str:
        rows_angles, rows_inside = angles.reshape(-1, len(Channel)), inside.reshape(-1, len(Channel))
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
