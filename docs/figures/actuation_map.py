"""Tables of docs/internals/actuation_map.md."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cache

import mujoco
import numpy as np
from numpy.typing import NDArray

from aero.actuation import ActuationMap
from aero.actuation.coefficients import Coefficients, coefficients_from_toml, load_coefficients
from aero.channels import THUMB, Channel, Joint
from aero.floats import Floats
from aero.protocol import MAX_CODE
from aero.whole_file import write_whole
from figures.inputs import ROOT
from figures.results import Rows, Shipped
from figures.sample_text import rows_of
from simulator import RoutedHand
from simulator.geometry.winding import WINDING
from simulator.routed import TENDONS, build_routed
from train.identification.map_identification import (
    FLEXION,
    SETTLE_S,
    THUMB_CABLES,
    Capture,
    Identification,
    captured,
    coefficient_toml,
    comparison,
    ends,
    identify,
    joined,
    open_command,
)

WINDOWS = (
    ("pre to 0.1.5", "0.1.5", "unshifted", "always"),
    ("0.2.0", "0.2.0", "homed", "power-on, HOMING"),
    ("0.2.0, never homed", "0.2.0", "unshifted", "flashed over an older version, not homed since"),
    ("0.2.0, restarted", "0.2.0", "mixed", "any other restart after homing"),
)
"""Name of the row, firmware, state, and what leads to it."""
PAPER_MM = {"CMC cable by CMC": 12.64, "flexor by MCP and IP together": 18.25}
"""The paper's effective radii of its simulator."""

FILE = "aero/actuation/coefficients/identified.toml"
GRID_LEVELS = 10
GRID_HOLD_S = 0.6
"""From one grid node to rest at the next, s."""
GRID_ABDUCTIONS = (0.0, 0.35, 0.7, 1.05, 1.4, 1.7)
"""Abductions at which the grid is repeated to cover the workspace, rad."""


def windows() -> Rows:
    """Where codes 0 and 65535 put the two shafts whose windows firmware 0.2.0 moves."""
    rows = [["firmware", "state", "abduction", "CMC flexion", "reached by"]]
    for name, firmware, state, reached in WINDOWS:
        codec = ActuationMap.for_firmware(firmware, state)
        low, high = (
            np.rad2deg(codec.angles_from_codes(np.full(len(Channel), code, np.uint16))) for code in (0, MAX_CODE)
        )
        shafts = (Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION)
        rows.append([name, state, *(f"{low[shaft]:z.2f} to {high[shaft]:.2f}°" for shaft in shafts), reached])
    return rows


@cache
def identified() -> Identification:
    """Identify the map of the routed hand as `python -m train.identification.map_identification` does."""
    return identify(RoutedHand())


def coefficients() -> Rows:
    """Each identified number beside the paper's."""
    return comparison(identified())


@dataclass(frozen=True)
class Residuals:
    """How far coefficients are from what the simulator did; the last axis is CMC, MCP, IP or the two cables."""

    joints_rms_rad: Floats
    """(3,) estimated against true joint angles."""
    joints_max_rad: Floats
    round_trip_rms_m: Floats
    """(2,) forward and inverse map composed, simulator length to travel to simulator length."""
    round_trip_max_m: Floats
    round_trip_max_rad: Floats
    """(3,) the same, seen in the estimated joint angles."""


def score(coefficients: Coefficients, capture: Capture) -> Residuals:
    """Compare coefficients with a capture."""
    codec = ActuationMap(coefficients)
    estimate = codec.thumb_joints_from_lengths(capture.lengths)
    error = estimate - capture.joints[:, FLEXION]
    back = codec.lengths_from_travel(codec.travel_from_lengths(capture.lengths))
    trip = (back - capture.lengths)[:, THUMB_CABLES]
    trip_joints = codec.thumb_joints_from_lengths(back) - estimate
    return Residuals(_rms(error), _max(error), _rms(trip), _max(trip), _max(trip_joints))


def _rms(errors: Floats) -> Floats:
    rms: Floats = np.sqrt((errors**2).mean(axis=0))
    return rms


def _max(errors: Floats) -> Floats:
    largest: Floats = np.abs(errors).max(axis=0)
    return largest


def thumb_grid(hand: RoutedHand, abduction: float) -> Capture:
    """Settle at the 10 x 10 nodes over both thumb cables' command ranges, abduction (rad) held.

    One sweep a level of the CMC cable, (100, ...) samples in all, both cables from open to closed.
    """
    rows = []
    cmc_open, cmc_closed = ends(hand, Channel.THUMB_CMC_FLEXION)
    flexor_open, flexor_closed = ends(hand, Channel.THUMB_FLEXOR)
    for cmc in np.linspace(cmc_open, cmc_closed, GRID_LEVELS):
        goal = open_command(hand)
        goal[[*THUMB]] = abduction, cmc, flexor_open
        hand.command(goal)
        hand.advance(SETTLE_S)
        samples = []
        for flexor in np.linspace(flexor_open, flexor_closed, GRID_LEVELS):
            goal[Channel.THUMB_FLEXOR] = flexor
            hand.command(goal)
            hand.advance(GRID_HOLD_S)
            samples.append((hand.lengths(), hand.joint_angles()))
        rows.append(captured(samples))
    return joined(rows)


@cache
def scores() -> dict[str, Residuals]:
    """Compare both sets of coefficients with the staircases, and with grids that neither was fitted to."""
    result, paper, hand = identified(), load_coefficients("paper"), RoutedHand()
    workspace = joined(thumb_grid(hand, abduction) for abduction in GRID_ABDUCTIONS)
    return {
        "identified, staircases (in sample)": score(result.coefficients, result.staircases),
        "identified, grids over abduction": score(result.coefficients, workspace),
        "paper, grids over abduction": score(paper, workspace),
    }


def residuals() -> Rows:
    """Joints against those estimated from lengths, and both maps one after the other: rms, largest in brackets."""
    rows = [
        [
            "coefficients, capture",
            *(f"{joint}, mrad" for joint in ("CMC", "MCP", "IP")),
            "round trip CMC cable, mm",
            "round trip flexor cable, mm",
            "round trip, largest CMC / MCP / IP, mrad",
        ]
    ]
    for name, errors in scores().items():
        joints = zip(1e3 * errors.joints_rms_rad, 1e3 * errors.joints_max_rad, strict=True)
        trips = zip(1e3 * errors.round_trip_rms_m, 1e3 * errors.round_trip_max_m, strict=True)
        rows.append(
            [
                name,
                *(f"{rms:.1f} ({largest:.1f})" for rms, largest in joints),
                *(f"{rms:.3f} ({largest:.3f})" for rms, largest in trips),
                " / ".join(f"{largest:.1f}" for largest in 1e3 * errors.round_trip_max_rad),
            ]
        )
    return rows


class RoutedLengths:
    """Cable lengths of the routed hand at a posture: kinematics only, so that nothing yields and nothing rubs."""

    def __init__(self) -> None:
        self._model = build_routed().compile()
        self._data = mujoco.MjData(self._model)
        self._tendons = [self._model.tendon(name).id for name in TENDONS.values()]
        self.upper_limits = self._model.jnt_range[: len(Joint), 1].copy()

    def radii(self, *joints: Joint) -> NDArray[np.float64]:
        """Return the cable taken up over the range of joints that turn together, divided by it, (7,) float, m/rad."""
        angle = self.upper_limits[joints[0]]
        radii: NDArray[np.float64] = (self._at(()) - self._at(joints, angle)) / angle
        return radii

    def _at(self, joints: tuple[Joint, ...], angle: float = 0.0) -> NDArray[np.float64]:
        self._data.qpos[:] = 0.0
        self._data.qpos[list(joints)] = angle
        mujoco.mj_fwdPosition(self._model, self._data)
        lengths = np.zeros(len(Channel))
        lengths[list(TENDONS)] = self._data.ten_length[self._tendons]
        return lengths


def radii() -> Rows:
    """The routed hand's radii beside the CAD's and the paper's."""
    hand = RoutedLengths()
    cmc, flexor = Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR
    chosen = [
        ("index by MCP", Channel.INDEX, (Joint.INDEX_MCP,)),
        ("index by PIP", Channel.INDEX, (Joint.INDEX_PIP,)),
        ("index by DIP", Channel.INDEX, (Joint.INDEX_DIP,)),
        ("CMC cable by CMC", cmc, (Joint.THUMB_CMC,)),
        ("flexor by CMC", flexor, (Joint.THUMB_CMC,)),
        ("flexor by MCP", flexor, (Joint.THUMB_MCP,)),
        ("flexor by IP", flexor, (Joint.THUMB_IP,)),
        ("CMC cable by abduction", cmc, (Joint.THUMB_ABDUCTION,)),
        ("flexor by abduction", flexor, (Joint.THUMB_ABDUCTION,)),
        ("flexor by MCP and IP together", flexor, (Joint.THUMB_MCP, Joint.THUMB_IP)),
    ]
    rows = [["radius, mm/rad", "routed hand", "paper's simulator", "CAD", "difference to CAD"]]
    for name, channel, joints in chosen:
        here, cad = 1e3 * hand.radii(*joints)[channel], 1e3 * sum(WINDING[channel][joint] for joint in joints)
        paper = f"{PAPER_MM[name]:.2f}" if name in PAPER_MM else ""
        rows.append([name, f"{here:z.2f}", paper, f"{cad:.2f}", f"{100.0 * (here / cad - 1.0):+.1f} %"])
    return rows


def identified_anew() -> Rows:
    """The coefficients as identified here."""
    return _numbers_of(coefficients_from_toml(coefficient_toml(identified(), "right")))


def shipped() -> Rows:
    """The coefficients that ship."""
    return _numbers_of(load_coefficients("identified"))


def make() -> None:
    """Write the coefficients."""
    write_whole(ROOT / FILE, coefficient_toml(identified(), "right"))


def _numbers_of(coefficients: Coefficients) -> Rows:
    return rows_of({name: value for name, value in asdict(coefficients).items() if not isinstance(value, str)})


TABLES = (windows, coefficients, residuals, radii)
SHIPPED = {
    "identified": Shipped((FILE,), (), identified_anew, make, shipped),
}
