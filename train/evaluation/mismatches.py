"""What each mismatch between simulator and hand costs a policy, one at a time through every byte.

The hand without any mismatch is the one that the actuation map describes, on servos that act at once. Each row departs
from it in one thing by as much as one physical hand does (`model/units/reference.toml`), or its host does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from aero.channels import Channel
from aero.firmware import DEFAULT_FIRMWARE
from aero.policy.correction import NO_CORRECTION
from aero.policy.running import RunSettings
from aero.whole_file import whole
from model.parameters import BuiltHandParameters
from model.units import Unit, load_unit
from train.evaluation.cube_trial import CubeTrial, Surroundings
from train.evaluation.trial_set import Interval, mean_interval
from train.evaluation.trials import Case

Floats = NDArray[np.float64]

GRAVITY = 9.81
"""m/s²; the unit `ideal` hangs in no field, and a cube would float."""
FLEXOR_RADIUS = 0.82
"""Flexor's winding radius for MCP and IP in the simulator over that of CAD (docs/actuation_map.md)."""


@dataclass(frozen=True)
class Mismatch:
    """How a hand or its host departs from what the policy was trained on."""

    name: str
    hand: Mapping[str, Any] = field(default_factory=dict)
    """Parameters of the hand."""
    servos: Mapping[str, Any] = field(default_factory=dict)
    """Parameters of its servos."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """How the loop runs."""
    surroundings: Mapping[str, Any] = field(default_factory=dict)
    """What the host believes."""


def _of_recorded(*names: str) -> dict[str, Any]:
    return {name: getattr(load_unit("reference").hand, name) for name in names}


def _flexor_scale() -> tuple[float, ...]:
    scale = list(BuiltHandParameters().winding_scale)
    scale[Channel.THUMB_FLEXOR] = FLEXOR_RADIUS
    return tuple(scale)


NO_MISMATCH = "none"
SINGLE = (
    Mismatch("abduction coupling", hand=_of_recorded("abduction_winding")),
    Mismatch("flexor radius", hand={"winding_scale": _flexor_scale()}),
    Mismatch("cable lengths", hand=_of_recorded("cable_take_up")),
    Mismatch("springs", hand=_of_recorded("spring_open", "spring_closed")),
    Mismatch("friction", hand=_of_recorded("spool_friction", "cable_friction", "joint_friction")),
    Mismatch("dead time of the servos", servos={"goal_delay_s": load_unit("reference").servos.goal_delay_s}),
    Mismatch("command a period late", settings={"one_period_late": True}),
    Mismatch("window shift", surroundings={"assumed_firmware": "0.1.5"}),
    Mismatch("whole degrees", surroundings={"step_rad": np.radians(1.0)}),
)
"""One thing each."""


def _together() -> Mismatch:
    parts = ("hand", "servos", "settings", "surroundings")
    return Mismatch(
        "all of them", **{part: {k: v for one in SINGLE for k, v in getattr(one, part).items()} for part in parts}
    )


MISMATCHES = (Mismatch(NO_MISMATCH), *SINGLE, _together())


def over_mismatches(trials: int, *, seconds: float, seed: int) -> list[Case]:
    """Return the trials of each mismatch, with the paper's cube and the same starts; nothing is corrected for."""
    ideal = load_unit("ideal")
    base = replace(ideal, hand=replace(ideal.hand, gravity=GRAVITY), servos=replace(ideal.servos, goal_delay_s=0.0))
    return [_case(base, one, seconds, seed + k) for one in MISMATCHES for k in range(trials)]


def _case(base: Unit, one: Mismatch, seconds: float, seed: int) -> Case:
    unit = replace(base, hand=replace(base.hand, **one.hand), servos=replace(base.servos, **one.servos))
    settings = RunSettings(seconds=seconds, correction=NO_CORRECTION, **one.settings)
    return Case(one.name, unit, DEFAULT_FIRMWARE, seed, settings, Surroundings(**one.surroundings))


@dataclass(frozen=True)
class Lost:
    """What a mismatch costs."""

    name: str
    trials: int
    kept: float
    """Share."""
    rate_rad_s: float
    """Mean."""
    lost_rad_s: float
    """Rate without any mismatch less this one's, mean over the trials, which have the same starts."""
    interval: Interval
    """Bootstrapped interval of that mean; NaN for no mismatch, and with fewer than `trial_set.LEAST` trials."""


def lost(rows: Mapping[str, Sequence[CubeTrial]]) -> list[Lost]:
    """Return what each mismatch costs, as far as its trials were made."""
    without = np.array([one.rate_rad_s for one in rows[NO_MISMATCH]])
    found = []
    for name, trials in rows.items():
        rates = np.array([one.rate_rad_s for one in trials])
        cost = without[: len(rates)] - rates
        kept = float(np.mean([one.kept for one in trials]))
        found.append(Lost(name, len(trials), kept, float(rates.mean()), float(cost.mean()), _interval(name, cost)))
    return found


def mismatch_picture(rows: Sequence[Lost], path: Path) -> None:
    """Draw what each mismatch costs."""
    shown = [row for row in rows if row.name != NO_MISMATCH]
    figure = Figure(figsize=(8, 0.45 * len(shown) + 1.5), layout="constrained")
    axes = figure.subplots()
    for position, row in enumerate(shown):
        axes.barh(position, row.lost_rad_s, color="tab:blue", alpha=0.6)
        axes.plot(row.interval, [position, position], color="black")
    axes.set_yticks(range(len(shown)), [row.name for row in shown])
    axes.invert_yaxis()
    axes.axvline(0.0, color="black", linewidth=0.6)
    axes.set_xlabel(f"rate lost, rad/s, of {rows[0].rate_rad_s:.2f} without any mismatch; lines: 95 %")
    axes.grid(axis="x", alpha=0.3)
    with whole(path) as draft:
        figure.savefig(draft, dpi=120)


def _interval(name: str, cost: Floats) -> Interval:
    return (np.nan, np.nan) if name == NO_MISMATCH else mean_interval(cost)
