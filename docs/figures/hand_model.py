"""Tables of docs/internals/hand_model.md."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from measured_hand import (
    blocked_finger,
    blocked_flexion,
    blocked_flexor,
    closing_errors,
    fingertip_force,
    opening_seconds,
    step_rise,
    tension_after_impact,
    tension_at_stall,
)
from servo_law import towards

from aero.actuation.coefficients import load_coefficients
from aero.channels import CABLES, FINGERS
from figures.actuation_map import thumb_grid
from figures.results import Rows
from firmware_emulator.plant import Drive
from hil.checks.staircase.reachable_range import calibrated_range
from simulator import RoutedHand, build_routed
from train.identification.map_identification import fit_inverse, fit_joints

ABDUCTION = 0.8
"""At which the released model's thumb was fitted, rad."""
CLOSING = (0.05, 0.2, 0.5, 0.75, 0.9)
ABDUCTIONS = (0.0, 0.5, 0.75, 1.0)


def routed() -> Rows:
    """The routed hand beside the released tendon model."""
    hand = RoutedHand()
    spans = np.ptp(calibrated_range(hand), axis=1)
    grid = thumb_grid(hand, ABDUCTION)
    cmc, flexor = fit_inverse(load_coefficients("paper"), grid)
    mass = float(build_routed().compile().body_mass.sum())
    return [
        ("one actuator swept over its range, the others extended", "here", "released model"),
        ("index / middle / ring / pinky, mm", _each("{:.2f}", 1e3 * spans[:4]), "45.93 / 46.06 / 45.93 / 45.64"),
        ("abduction, rad", f"{spans[4]:.3f}", "1.742-1.747"),
        ("thumb CMC cable, mm", f"{1e3 * spans[5]:.2f}", "10.98"),
        ("thumb flexor cable, mm", f"{1e3 * spans[6]:.2f}", "26.66"),
        (
            "CMC gain, offset (mm/m, mm), abduction at 0.8 rad",
            _each("{:.1f}", 1e3 * cmc.coefficients[0], ", "),
            "-972 to -973, 37.4",
        ),
        ("flexor gain, offset", _each("{:.1f}", 1e3 * flexor.coefficients[0], ", "), "-1222, 135.2"),
        (
            "R² of CMC / MCP / IP over the two cables",
            _each("{:.4f}", fit_joints(grid).r_squared),
            "0.9998 / 0.9992 / 0.9992",
        ),
        ("mass, kg", f"{mass:.4f}", "0.4467"),
    ]


def built() -> Rows:
    """The built hand with its defaults beside the physical hand and the paper."""
    released = max(opening_seconds(Drive(powered=False)), opening_seconds(towards(0.0)))
    rise, overshoot = step_rise()
    return [
        ("quantity", "here", "physical hand, paper"),
        (
            "counts of error, finger closing to 5 / 20 / 50 / 75 / 90 %",
            _each("{:.0f}", closing_errors(CLOSING)),
            "4-15 / 12-17 / 18-19 / 23-26 / 23-29",
        ),
        (
            "finger blocked by 0.33 N m, of 288.16°",
            _range("{:.3f}", [blocked_finger(finger) for finger in FINGERS]),
            "0.976-0.979",
        ),
        (
            "flexion blocked, abduction at 0 / 0.5 / 0.75 / 1",
            _each("{:.3f}", [blocked_flexion(abduction) for abduction in ABDUCTIONS]),
            "0.605 / 0.73 / 0.93 / 0.97",
        ),
        ("flexor blocked without abduction", f"{blocked_flexor():.3f}", "0.826"),
        ("opening after release, unpowered or driven, s", f"{released:.2f}", "not measured"),
        (
            "cable tension at stall, reached slowly, N",
            _range("{:.1f}", [tension_at_stall(channel) for channel in CABLES]),
            "66 at most",
        ),
        (
            "after running into the stop at full effort (friction holds on), N",
            _range("{:.1f}", [tension_after_impact(channel) for channel in CABLES]),
            "",
        ),
        (
            "fingertip force, extended finger at stall, N",
            _range("{:.1f}", [fingertip_force(finger.label) for finger in FINGERS]),
            "about 12",
        ),
        (
            "the same, extended thumb: flexor / CMC flexion at stall, N",
            _each("{:.1f}", [fingertip_force("thumb", channel) for channel in ("thumb_flexor", "thumb_cmc_flexion")]),
            "about 12",
        ),
        ("164-count step, 10-90 %, ms", f"{1e3 * rise:.0f}", "about 50"),
        ("its overshoot, % of the step", f"{100.0 * overshoot:.1f}", "none"),
    ]


def _each(template: str, values: Iterable[float], between: str = " / ") -> str:
    return between.join(map(template.format, values))


def _range(template: str, values: Iterable[float]) -> str:
    listed = [*values]
    return f"{template.format(min(listed))} to {template.format(max(listed))}"


TABLES = (routed, built)
