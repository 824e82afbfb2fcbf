"""Second implementation of the paper's actuation map, to test `aero.actuation`; shares no code with it.

Converts simulator lengths (m, abduction in rad) to position codes of a right or a left hand, and back, in command
order. Equations and numbers: paper, chapter "Actuation Mapping"; further digits from the deployment of the paper
(aero-hand-open 7084ad3), the shift of the windows from firmware 0.2.0 (6a3022d).
"""

import numpy as np

from aero.floats import Floats

MAP = "paper"
"""Name of these coefficients in a recording."""
SPOOL_M = 9.0e-3
FULL = 65535

# Fingers: lengths of the extended hand and of the fist, m; eq. (servomap).
_EXTENDED_M = np.array([0.107723, 0.1084, 0.10775, 0.109504])
_FIST_M = np.array([0.0617776, 0.0621875, 0.0616733, 0.0637823])
# Cable of a finger in the fist, three joints at 90°; eq. (windingcoeff).
_FINGER_M = (12.4912e-3 + 7.3211e-3 + 9.0e-3) * np.pi / 2

# Columns abduction, CMC cable, flexor cable, constant; rows CMC, MCP, IP; eq. (thumbcoef).
_JOINTS = np.array(
    [
        [0.000344, -78.088995, 0.188440, 2.977490],
        [0.004162, -11.373921, -56.722756, 6.666491],
        [0.004528469071, -11.422035184, -56.887542892, 6.687096102],
    ]
)
# Columns abduction, CMC, MCP, IP, m/rad; rows CMC cable, flexor cable; eqs. (thumbcmc), (thumbflexor).
_CABLES = np.array([[2.5e-3, 12.4931e-3, 0.0, 0.0], [2.5e-3, -2.5e-3, 9.4372e-3, 12.5e-3]])
# Cable per length of the simulator, and offset, m; eq. (thumbinv).
_GAIN = np.array([-0.977220399, -1.241571958])
_OFFSET_M = np.array([0.037517992, 0.136590025])

# Shaft angles at codes 0 and 65535, degrees: abduction to 100°, CMC to 55°, MCP and IP to 90°; eq. (actrange).
_FINGER_DEG = np.rad2deg(_FINGER_M / SPOOL_M)
_CMC_DEG = (2.5 * 100 + 12.4931 * 55) / 9.0
_FLEXOR_DEG = (-2.5 * 55 / 9.0, (2.5 * 100 + 9.4372 * 90 + 12.5 * 90) / 9.0)
_WINDOW_DEG = np.array([*((0.0, _FINGER_DEG),) * 4, (0.0, 100.0), (0.0, _CMC_DEG), _FLEXOR_DEG])
# Shift of both ends by homing in firmware 0.2.0: 10° in whole counts, abduction closed, CMC open.
_SHIFT_DEG = 113 * 360 / 4096
_SHIFTED = {"unshifted": (0.0, 0.0), "mixed": (1.0, 0.0), "homed": (1.0, 1.0)}


def window_deg(state: str) -> Floats:
    """Return the shaft angles of codes 0 and 65535, (7, 2) float, degrees, for a calibration state of the firmware."""
    shift = _SHIFT_DEG * np.array(_SHIFTED[state])
    window: Floats = _WINDOW_DEG + np.array([*((0.0, 0.0),) * 4, shift, -shift, (0.0, 0.0)])
    return window


def codes_of_lengths(lengths: Floats, state: str) -> Floats:
    """Return the codes (n, 7) of lengths (n, 7), rounded and clipped to 0..65535, for a calibration state."""
    fingers = (_EXTENDED_M - lengths[:, :4]) / (_EXTENDED_M - _FIST_M) * _FINGER_M / SPOOL_M
    abduction = lengths[:, 4]
    joints = _JOINTS @ np.stack([abduction, lengths[:, 5], lengths[:, 6], np.ones(len(lengths))])
    cables = _CABLES @ np.vstack([abduction, joints]) / SPOOL_M
    angles_deg = np.rad2deg(np.column_stack([fingers, abduction, *cables]))
    low, high = window_deg(state).T
    codes: Floats = np.clip(np.rint((angles_deg - low) / (high - low) * FULL), 0, FULL)
    return codes


def lengths_of_codes(codes: Floats, state: str) -> Floats:
    """Return the lengths (n, 7) of codes (n, 7) for a calibration state; eq. (inversechain)."""
    low, high = window_deg(state).T
    angles = np.deg2rad(low + codes / FULL * (high - low))
    fingers = _EXTENDED_M - angles[:, :4] * SPOOL_M / _FINGER_M * (_EXTENDED_M - _FIST_M)
    abduction = angles[:, 4]
    cables = (angles[:, 5:] * SPOOL_M - _OFFSET_M - 2.5e-3 * abduction[:, None]) / _GAIN
    return np.column_stack([fingers, abduction, cables])
