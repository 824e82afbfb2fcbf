"""Command window of each channel: the shaft angles for codes 0..65535, as set by the firmware.

The board stores two servo counts a channel, `extend` for code 0 and `grasp` for code 65535. At the baseline counts,
equal in every firmware, the window is the channel's excursion (paper eq. actrange). Homing with firmware 0.2.0 shifts
two thumb windows by 113 counts (9.93°): abduction further closed, CMC flexion further open. The board stores only the
shifted extended ends, so a hand can be in three states. No board reports its version or state; the user must.

Counts and angles agree to 0.02° on the fingers and on abduction, 0.15° on CMC flexion and 0.52° on the flexor, whose
span is 2980 counts instead of the 2986 that 262.43° make. As in the paper and the SDK, an unshifted window *is* the
excursion; counts enter only as the difference from the baseline.

Source: aero-open-firmware d7bd82e (baselines), aero-hand-open 6a3022d (0.2.0), dd91e5a (`main`, the same windows).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.actuation.arrays import whole_numbers
from aero.channels import Channel
from aero.firmware import firmware_of
from aero.protocol import MAX_CODE

COUNTS_PER_TURN = 4096
"""Servo counts in one turn of an output shaft."""


Counts = tuple[int, ...]

_BASELINE: dict[str, tuple[Counts, Counts]] = {
    "right": ((3278, 3278, 3278, 3278, 2048, 3231, 1115), (0, 0, 0, 0, 910, 2048, 4095)),
    "left": ((817, 817, 817, 817, 2048, 865, 2980), (4095, 4095, 4095, 4095, 3186, 2048, 0)),
}
"""Extend and grasp counts of each hand, command order."""

_SHIFT_COUNTS = math.trunc(10 / 360 * (COUNTS_PER_TURN - 1))
SHIFT_CLOSING = {Channel.THUMB_ABDUCTION: _SHIFT_COUNTS, Channel.THUMB_CMC_FLEXION: -_SHIFT_COUNTS}
"""Shift of each window by homing with firmware 0.2.0, counts in the closing direction."""

CALIBRATIONS = {
    "homed": "after power-on or homing: both ends of the shifted windows",
    "unshifted": "flashed over an older version and never homed since: as firmware 0.1.5 and before",
    "mixed": "any other restart after homing: the extended ends are shifted, the closed ends are not",
}
"""Calibration states of firmware 0.2.0 and `main`, with their cause."""


@dataclass(frozen=True)
class CommandWindow:
    """Servo counts at both ends of each channel's codes, for one hand in one calibration state."""

    name: str
    """Name of the calibration state, for messages and recordings."""
    side: str
    """`right` or `left`."""
    extend_counts: Counts
    """Servo counts at code 0, command order."""
    grasp_counts: Counts
    """Servo counts at code 65535, command order."""

    def __post_init__(self) -> None:
        if self.side not in _BASELINE:
            raise ValueError(f"side must be one of {sorted(_BASELINE)}, got {self.side!r}")
        for field in ("extend_counts", "grasp_counts"):
            counts = whole_numbers(getattr(self, field), len(Channel), 0, COUNTS_PER_TURN - 1, field)
            if counts.ndim != 1:
                raise ValueError(f"{field}: expected seven counts, got shape {counts.shape}")
            object.__setattr__(self, field, tuple(counts.tolist()))  # the caller may keep its array
        if not np.all(self._closing_sign() * (np.subtract(self.grasp_counts, self.extend_counts)) > 0):
            raise ValueError(f"no window of a {self.side} hand: {self.extend_counts} to {self.grasp_counts}")

    @classmethod
    def for_firmware(cls, version: str, calibration: str | None = None, side: str = "right") -> CommandWindow:
        """Return the window of a firmware version in one of its calibration states.

        Args:
            version: `pre`, `0.1.0` to `0.2.0`, or `main`.
            calibration: one of `CALIBRATIONS`; None for the version's typical state (`homed` for 0.2.0 and `main`).
            side: `right` or `left`.

        Raises:
            ValueError: an unknown version, hand or state, or a state that the version cannot be in.
        """
        possible = firmware_of(version).calibration_states
        state = calibration or possible[0]
        if state not in possible:
            raise ValueError(f"firmware {version} cannot be {state!r}; it can be {' or '.join(possible)}")
        if side not in _BASELINE:
            raise ValueError(f"side must be one of {sorted(_BASELINE)}, got {side!r}")
        extend, grasp = (np.array(counts) for counts in _BASELINE[side])
        closing = np.sign(grasp - extend)
        for channel, shift in SHIFT_CLOSING.items():
            extend[channel] += closing[channel] * shift * (state in ("homed", "mixed"))
            grasp[channel] += closing[channel] * shift * (state == "homed")
        return cls(state, side, tuple(extend.tolist()), tuple(grasp.tolist()))

    def shifts_rad(self) -> NDArray[np.float64]:
        """Return the shift of both ends from the baseline, (7, 2) float, rad, positive in the closing direction."""
        ends = np.array([self.extend_counts, self.grasp_counts])
        counts = self._closing_sign() * (ends - np.array(_BASELINE[self.side]))
        shifts: NDArray[np.float64] = counts.T * (2.0 * np.pi / COUNTS_PER_TURN)
        return shifts

    def spans_counts(self) -> NDArray[np.int64]:
        """Return the counts between the two ends, (7,) int, positive; readings are multiples of 65535 over these."""
        return np.abs(np.subtract(self.grasp_counts, self.extend_counts))

    def _closing_sign(self) -> NDArray[np.int64]:
        extend, grasp = np.array(_BASELINE[self.side])
        signs: NDArray[np.int64] = np.sign(grasp - extend)
        return signs


UNSHIFTED = CommandWindow.for_firmware("0.1.5")
"""Command window of the paper and of every firmware up to 0.1.5."""


def fits_span(readings: ArrayLike, span_counts: ArrayLike) -> NDArray[np.bool_]:
    """Return a mask of the readings (0..65535) that a window of `span_counts` can produce; both arguments broadcast.

    The board reports `floor(n * 65535 / span)` for a shaft n servo counts into a window of `span` counts. A handful of
    different readings therefore reveals the span, which identifies the mixed state of firmware 0.2.0 and a trimmed
    channel. The homed and the unshifted state have equal spans. A reading fits a wrong span by chance with a
    probability of `span_counts` / 65535, 2 to 5 %.

    Raises:
        ValueError: not integers, or out of range.
    """
    codes = whole_numbers(readings, None, 0, MAX_CODE, "readings")
    span = whole_numbers(span_counts, None, 1, COUNTS_PER_TURN - 1, "span_counts")
    counts = -(-codes * span // MAX_CODE)
    fits: NDArray[np.bool_] = counts * MAX_CODE // span == codes
    return fits
