"""Coefficients of the actuation map: winding radii of the mechanism and a fit on the simulator.

Two sets are shipped: `paper`, the published one and the default, and `identified`, fitted to this project's model by
`python -m train.identification.map_identification`. A set for another hand or model loads from a TOML file.
"""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from aero.regular_file import read_text

SHIPPED = ("paper", "identified")
_FINGER_JOINTS = ("mcp", "pip", "dip")
_THUMB_JOINTS = ("abduction", "cmc", "mcp", "ip")
_SIMULATION = ("finger_lengths", "thumb_regression", "thumb_gain", "thumb_offset")
_SHAPES = {
    "finger_winding": (3,),
    "thumb_winding": (2, 4),
    "finger_lengths": (4, 2),
    "thumb_regression": (3, 4),
    "thumb_gain": (2,),
    "thumb_offset": (2,),
}

Vector = tuple[float, ...]
Matrix = tuple[Vector, ...]


@dataclass(frozen=True)
class Coefficients:
    """Coefficients of an actuation map, SI units; tuples, so that a map can be compared, hashed and made static."""

    name: str
    """Name of the set in recordings and messages."""
    source: str
    """Origin of the numbers."""
    finger_winding: Vector
    """(3,) cable taken up per MCP, PIP and DIP angle, m/rad, equal for all fingers."""
    thumb_winding: Matrix
    """(2, 4) rows CMC cable and flexor cable; per abduction, CMC, MCP and IP angle, m/rad."""
    spool_radius: float
    """Winding radius of every cable channel's spool, m."""
    finger_lengths: Matrix
    """(4, 2) shortest and longest finger cable in the simulator, m."""
    thumb_regression: Matrix
    """(3, 4) rows CMC, MCP, IP; per abduction (rad), CMC cable (m), flexor cable (m), and constant; rad."""
    thumb_gain: Vector
    """(2,) travel of the CMC and flexor cable on the hand per length in the simulator, m/m."""
    thumb_offset: Vector
    """(2,) constant terms beside `thumb_gain`, m."""

    def __post_init__(self) -> None:
        for field, shape in _SHAPES.items():
            array = np.array(getattr(self, field), np.float64)
            if array.shape != shape or not np.isfinite(array).all():
                self._refuse(field, f"must be finite and have shape {shape}")
            # Convert to tuples, so that the caller's list cannot change them later.
            rows = array.tolist()
            object.__setattr__(self, field, tuple(map(tuple, rows)) if array.ndim == 2 else tuple(rows))
        if not (math.isfinite(self.spool_radius) and self.spool_radius > 0.0):
            self._refuse("spool_radius", "must be positive")
        for field in ("finger_winding", "thumb_gain"):
            if 0.0 in getattr(self, field):
                self._refuse(field, "must not hold a zero")
        (_, cmc_cmc, *cmc_distal), (_, flexor_cmc, *flexor_distal) = self.thumb_winding
        if cmc_cmc * sum(flexor_distal) == flexor_cmc * sum(cmc_distal):
            self._refuse("thumb_winding", "must not be singular for CMC against MCP and IP")
        if any(shortest >= longest for shortest, longest in self.finger_lengths):
            self._refuse("finger_lengths", "are [shortest, longest]")

    def _refuse(self, field: str, why: str) -> NoReturn:
        raise ValueError(f"coefficients {self.name!r}: {field} {why}, got {getattr(self, field)}")


def load_coefficients(name_or_path: str | Path) -> Coefficients:
    """Load a shipped set by name (`paper`, `identified`) or any set from a TOML file.

    Raises:
        ValueError: a missing or unknown key, or a wrong shape; the message names it.
        OSError: no such file.
    """
    if name_or_path in SHIPPED:
        return _load_shipped(str(name_or_path))
    path = Path(name_or_path)
    try:
        return coefficients_from_toml(read_text(path))
    except OSError as error:
        what = f"cannot read these coefficients: {error.strerror or error}"
        hint = f"{what}; shipped are {', '.join(SHIPPED)}, or give a .toml file"
        raise OSError(error.errno, hint, str(name_or_path)) from error
    except (ValueError, TypeError, AttributeError, KeyError, OverflowError, RecursionError) as error:
        raise ValueError(f"{path}: {error}") from error


def coefficients_from_toml(text: str) -> Coefficients:
    """Parse a coefficient file; keys outside `Coefficients` are provenance for readers and ignored."""
    data = tomllib.loads(text)
    try:
        mechanism, simulation = data["mechanism"], data["simulation"]
        return Coefficients(
            name=data["name"],
            source=data["source"],
            finger_winding=_by_joint(mechanism["finger_winding"], _FINGER_JOINTS),
            thumb_winding=(
                _by_joint(mechanism["thumb_cmc_winding"], _THUMB_JOINTS),
                _by_joint(mechanism["thumb_flexor_winding"], _THUMB_JOINTS),
            ),
            spool_radius=float(mechanism["spool_radius"]),
            **{field: simulation[field] for field in _SIMULATION},
        )
    except KeyError as error:
        raise ValueError(f"coefficient file: the key {error} is missing") from error


@cache
def _load_shipped(name: str) -> Coefficients:
    return coefficients_from_toml(resources.files(__name__).joinpath(f"{name}.toml").read_text(encoding="utf-8"))


def _by_joint(values: Mapping[str, Any], joints: tuple[str, ...]) -> Vector:
    if set(values) != set(joints):
        raise ValueError(f"coefficient file: expected one winding radius for each of {joints}, got {tuple(values)}")
    return tuple(float(values[joint]) for joint in joints)
