"""Unit as a TOML file for `model.units`, each number with its physical unit and source."""

import dataclasses
import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.units import Unit
from train.identification.uncertainty import Intervals

PHYSICAL_UNITS: Mapping[str, str] = {
    "goal_delay_s": "s",
    "duty_per_count": "share of full duty per count",
    "duty_per_count_per_s": "share of full duty per count/s",
    "no_load_speed_counts": "counts/s",
    "rotor_inertia": "kg m²",
    "cable_friction": "share of the cable's tension",
    "spool_friction": "N m",
    "spring_open": "N m",
    "spring_closed": "N m",
    "closed_stop": "rad",
    "abduction_winding": "m/rad",
    "cable_take_up": "m, negative is pretension",
    "supply_sag": "share of the voltage lost per (N m)² of duty times current",
}
STARTING = "as the starting unit"
NOT_TOLD = " (not determined by the recordings)"
"""Suffix of an interval that is as wide as the prior's."""
DIGITS = 5
"""Significant digits of a written number; counts are whole, so further digits do not change a prediction."""


def unit_toml(
    unit: Unit, description: str, intervals: Intervals, told: Mapping[str, NDArray[np.bool_]] | None = None
) -> str:
    """Return a unit as TOML: the fields that differ from the defaults, except derived ones, each with its source.

    Args:
        unit: the unit.
        description: identity of the hand.
        intervals: 95 % intervals of the fitted fields. Missing fields and entries with equal bounds are marked as
            copied from the starting unit.
        told: masks of the entries that the readings determine; all entries of a missing field.
    """
    told = told or {}
    lines = [f"description = {json.dumps(description, ensure_ascii=False)}"]
    default = Unit()
    if unit.unfinished:
        lines.append("unfinished = true")
    for section in ("hand", "servos"):
        values, defaults = (dataclasses.asdict(getattr(u, section)) for u in (unit, default))
        changed = {key: value for key, value in values.items() if value != defaults[key] and key != "back_emf"}
        if changed:
            lines += ["", f"[{section}]"]
        for key, value in changed.items():
            source = _source(intervals.get(name := f"{section}.{key}"), told.get(name))
            lines += [f"# {PHYSICAL_UNITS[key]}; {source}" if key in PHYSICAL_UNITS else f"# {source}"]
            lines += [f"{key} = {_value(value)}"]
    return "\n".join(lines) + "\n"


def _source(interval: tuple[NDArray[np.float64], NDArray[np.float64]] | None, told: NDArray[np.bool_] | None) -> str:
    if interval is None:
        return STARTING
    low, high = interval
    told = np.ones(low.shape, bool) if told is None else told
    spans = [
        STARTING if below >= above else f"{below:.3g} to {above:.3g}{'' if of_readings else NOT_TOLD}"
        for below, above, of_readings in zip(low, high, told, strict=True)
    ]
    return f"fitted, 95 % interval{' of each' if len(spans) > 1 else ''}: {'; '.join(spans)}"


def _value(value: Any) -> str:
    if isinstance(value, tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, float):
        return repr(float(f"{value:.{DIGITS}g}"))
    return json.dumps(value)
