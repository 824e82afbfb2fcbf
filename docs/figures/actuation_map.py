"""Tables of docs/actuation_map.md."""

from __future__ import annotations

import math
from functools import cache
from itertools import product

import numpy as np

from aero.actuation import ActuationMap
from aero.actuation.coefficients import load_coefficients
from aero.channels import FINGERS, Channel, Joint
from aero.protocol import MAX_CODE
from figures.cells import Cell
from figures.emulated import EXACT, SEEDED
from figures.sources import Row, Source
from hil.lab.map_identification.identify import Identification, identify
from hil.lab.map_identification.regression import flexor_radius, two_pose_radii
from model import RoutedHand
from model.geometry.winding import WINDING

JOINTS = ("CMC", "MCP", "IP")
REGRESSORS = ("abduction", "CMC cable", "flexor cable", "constant")
CAPTURES = (
    ("identified", "staircases", "identified, staircases (in sample)"),
    ("identified", "workspace", "identified, grids over abduction"),
    ("paper", "workspace", "paper, grids over abduction"),
)
"""Coefficient set, capture, and how the row is called."""
PAPER_MM = {"CMC cable by CMC": 12.64, "flexor by MCP and IP together": 18.25}
"""The paper's effective radii of its simulator."""


WINDOWS = (
    ("pre to 0.1.5", "0.1.5", "unshifted", "always"),
    ("0.2.0", "0.2.0", "homed", "power-on, HOMING"),
    ("0.2.0, never homed", "0.2.0", "unshifted", "flashed over an older version, not homed since"),
    ("0.2.0, restarted", "0.2.0", "mixed", "any other restart after homing"),
)
"""How the row is called, firmware, state, and what leads to it."""
SDK_DEG = [[0.0, 288.1603]] * 4 + [[0.0, 100.0], [0.0, 104.1250], [-15.2789, 247.1500]]
"""What aero-open-sdk 0.1.0.dev1 commands the hand against."""
THUMB_RANGES = ((0.0, math.radians(100.0)), (0.026941, 0.0382787), (0.0839985, 0.110133))
"""Of abduction (rad) and of the two thumb cables' sensors in the simulator (m; aero-hand-open 7084ad3)."""


def windows() -> list[Row]:
    """Where codes 0 and 65535 put the two shafts whose windows firmware 0.2.0 moves."""
    rows: list[Row] = [("firmware", "state", "abduction", "CMC flexion", "reached by")]
    for name, firmware, state, reached in WINDOWS:
        codec = ActuationMap.for_firmware(firmware, state)
        low, high = (
            np.rad2deg(codec.angles_from_codes(np.full(len(Channel), code, np.uint16))) for code in (0, MAX_CODE)
        )
        shafts = (Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION)
        rows.append(
            (name, state, *(Cell.of("{:.2f} to {:.2f}°", low[shaft], high[shaft]) for shaft in shafts), reached)
        )
    return rows


def agreement() -> list[Row]:
    """How far the map is from the SDK's excursions, and its two fits of the thumb cables from each other."""
    codec = ActuationMap()
    off = np.abs(np.rad2deg(codec.excursion_rad) - SDK_DEG).max(axis=1)
    # Both fits are affine, so the largest disagreement over the sensors' ranges is at a corner.
    thumb = np.array(list(product(*THUMB_RANGES)))
    fingers = np.array(load_coefficients("paper").finger_lengths)[:, 0]
    corners = np.hstack([np.broadcast_to(fingers, (len(thumb), len(fingers))), thumb])
    trip = np.abs(codec.lengths_from_travel(codec.travel_from_lengths(corners)) - corners).max(axis=0)
    return [
        ("what", "largest"),
        ("excursions of the thumb against what the SDK commands", Cell.of("{:.4f}°", off[4:].max())),
        ("excursions of the fingers", Cell.of("{:.3f}°", off[:4].max())),
        ("CMC cable: length to travel to length, two separate fits", Cell.of("{:.3f} mm", 1e3 * trip[5])),
        ("flexor cable", Cell.of("{:.3f} mm", 1e3 * trip[6])),
    ]


@cache
def identified() -> Identification:
    """Identify the map of the routed hand as `aero-hil identify` does."""
    return identify(RoutedHand())


def coefficients() -> list[Row]:
    """Each identified number beside the paper's; the difference also in standard errors."""
    found, paper = identified(), load_coefficients("paper")
    rows: list[Row] = [("entry", "identified", "standard error", "paper", "difference", "in standard errors")]
    for joint, name in enumerate(JOINTS):
        for regressor, by in enumerate(REGRESSORS):
            here, published = found.regression.coefficients[joint, regressor], paper.thumb_regression[joint][regressor]
            error = found.regression.standard_errors[joint, regressor]
            rows.append(_entry(f"{name} by {by}", here, error, published, 4 if by == "abduction" else 3))
    for cable, fit, gain, offset in zip(
        ("CMC", "flexor"), found.inverse, paper.thumb_gain, paper.thumb_offset, strict=True
    ):
        (here, there), (error, other) = 1e3 * fit.coefficients[0], 1e3 * fit.standard_errors[0]
        rows.append(_entry(f"gain of the {cable} cable, mm/m", here, error, 1e3 * gain, 1))
        rows.append(_entry(f"offset of the {cable} cable, mm", there, other, 1e3 * offset, 2))
    for finger in FINGERS:
        spans = [1e3 * float(np.ptp(set_.finger_lengths[finger])) for set_ in (found.coefficients, paper)]
        rows.append(
            (f"excursion of the {finger.label}, mm", Cell.of("{:.2f}", spans[0]), "", Cell.of("{:.2f}", spans[1]),
             Cell.of("{:+.2f}", spans[0] - spans[1]), "")
        )  # fmt: skip
    return rows


def _entry(name: str, here: float, error: float, published: float, digits: int) -> Row:
    number = f"{{:.{digits}f}}"
    return (
        name,
        Cell.of(number, here),
        Cell.of(number, error),
        Cell.of(number, published),
        Cell.of("{:+.1f} %", 100.0 * (here / published - 1.0)) if abs(published) > 0.01 else "",
        Cell.of("{:+.1f}", (here - published) / error),
    )


def fits() -> list[Row]:
    """How much of the variance the fits explain."""
    forward, inverse = identified().regression, identified().inverse
    explained = (*forward.r_squared, *(fit.r_squared[0] for fit in inverse))
    return [
        ("R²", *JOINTS, "CMC cable, inverse", "flexor cable, inverse"),
        ("staircases", *(Cell.of("{:.5f}", value) for value in explained)),
    ]


def residuals() -> list[Row]:
    """Joints against those estimated from lengths, and both maps one after the other: rms, largest in brackets."""
    rows: list[Row] = [
        (
            "coefficients, capture",
            *(f"{joint}, mrad" for joint in JOINTS),
            "round trip CMC cable, mm",
            "round trip flexor cable, mm",
            "round trip, largest CMC / MCP / IP, mrad",
        )
    ]
    for set_, capture, name in CAPTURES:
        score = identified().scores[set_][capture]
        joints = zip(1e3 * score.joints_rms_rad, 1e3 * score.joints_max_rad, strict=True)
        trips = zip(1e3 * score.round_trip_rms_m, 1e3 * score.round_trip_max_m, strict=True)
        rows.append(
            (
                name,
                *(Cell.of("{:.1f} ({:.1f})", *pair) for pair in joints),
                *(Cell.of("{:.3f} ({:.3f})", *pair) for pair in trips),
                Cell.of("{:.1f} / {:.1f} / {:.1f}", *(1e3 * score.round_trip_max_rad)),
            )
        )
    return rows


def radii() -> list[Row]:
    """The routed hand's radii beside the CAD's and the paper's."""
    found = 1e3 * two_pose_radii()
    cmc, flexor = Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR
    pairs = [
        *(
            (f"index by {joint.label.partition('_')[2].upper()}", Channel.INDEX, joint)
            for joint in (Joint.INDEX_MCP, Joint.INDEX_PIP, Joint.INDEX_DIP)
        ),
        ("CMC cable by CMC", cmc, Joint.THUMB_CMC),
        ("flexor by CMC", flexor, Joint.THUMB_CMC),
        ("flexor by MCP", flexor, Joint.THUMB_MCP),
        ("flexor by IP", flexor, Joint.THUMB_IP),
        ("CMC cable by abduction", cmc, Joint.THUMB_ABDUCTION),
        ("flexor by abduction", flexor, Joint.THUMB_ABDUCTION),
    ]
    rows = [(name, found[channel, joint], 1e3 * WINDING[channel][joint]) for name, channel, joint in pairs]
    together = 1e3 * (WINDING[flexor][Joint.THUMB_MCP] + WINDING[flexor][Joint.THUMB_IP])
    rows.append(("flexor by MCP and IP together", 1e3 * flexor_radius(), together))
    return [("radius, mm/rad", "routed hand", "paper's simulator", "CAD", "difference to CAD"), *map(_radius, rows)]


def _radius(row: tuple[str, float, float]) -> Row:
    name, here, cad = row
    return (
        name,
        Cell.of("{:.2f}", here),
        Cell.of("{:.2f}", PAPER_MM[name]) if name in PAPER_MM else "",
        Cell.of("{:.2f}", cad),
        Cell.of("{:+.1f} %", 100.0 * (here / cad - 1.0)),
    )


TABLES = {
    "windows": Source(windows, "`aero-hil map --firmware FIRMWARE --calibration STATE`", EXACT, origin=""),
    "agreement": Source(agreement, "Held by `pytest tests/aero/test_actuation_map.py`", EXACT, origin=""),
    "coefficients": Source(coefficients, "`aero-hil identify --out DIR`", SEEDED),
    "fits": Source(fits, "`aero-hil identify --out DIR`", SEEDED),
    "residuals": Source(residuals, "`aero-hil identify --out DIR`", SEEDED),
    "radii": Source(radii, "Held by `pytest tests/harness/lab/map_identification`", SEEDED),
}
