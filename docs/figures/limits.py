"""Limits that ship, and a sample of the readings behind them."""

from __future__ import annotations

import numpy as np

from figures.inputs import ROOT
from figures.results import Rows, Shipped
from train.campaign.trial import Trial, perform
from train.limits.__main__ import limits
from train.limits.population import drawn

KINDS = (("0.2.0", False, False), ("0.1.5", True, False), ("pre", True, False), ("0.2.0", True, True))
"""Firmware of the sampled hands, whether they are guarded, and whether they run the short staircase alone."""


def four_hands() -> Rows:
    """Readings of the first hand of each of four kinds in the population."""
    kinds: dict[tuple[str, bool, bool], Trial] = {}
    for trial in drawn():
        kinds.setdefault((trial.firmware, trial.guarded, "short_staircase" in trial.experiments), trial)
    return [("reading", "hand", "least", "greatest"), *(row for kind in KINDS for row in readings(kinds[kind]))]


def readings(trial: Trial) -> list[list[str]]:
    """Return the least and the greatest reading of each metric over the channels of a hand."""
    found: dict[str, list[float]] = {}
    for experiment, subjects in perform(trial).numbers.items():
        for numbers in subjects.values():
            for metric, value in numbers.items():
                found.setdefault(f"{experiment} {metric}", []).append(value)
    rows = {name: [value for value in values if np.isfinite(value)] or [np.nan] for name, values in found.items()}
    return [[name, trial.unit, f"{min(values):.5g}", f"{max(values):.5g}"] for name, values in rows.items()]


def make() -> None:
    """Validate the whole population, about 100 minutes of one core, resumed in `build/limits`."""
    limits(["--out", str(ROOT / "build" / "limits"), "--data", str(ROOT / "hil" / "data")], standalone_mode=False)


SHIPPED = {"limits": Shipped(("hil/data/limits.csv", "hil/data/population.toml"), (), four_hands, make)}
