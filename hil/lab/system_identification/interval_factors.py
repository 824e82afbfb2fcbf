"""How much wider than their own standard deviations intervals have to be to hold, by kind of number: measured.

The slopes and the misfit at the solution (`uncertainty.covariance`) tell less than all of the error. What they leave
out, such as a search that has not quite ended, is measured on emulated hands whose numbers are known:
`python -m figures.intervals` records and calibrates them and writes `hil/data/interval_factors.toml`.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from hil.lab.system_identification.search import Free
from hil.lab.system_identification.uncertainty import COVERAGE_SIGMA, Intervals

Floats = NDArray[np.float64]

COVERED = 0.95
"""Share of the numbers of a kind that their intervals hold."""
FILE = "interval_factors.toml"


def interval_factors() -> dict[str, float]:
    """Return the factor of each kind of number, by `section.field` or section."""
    table = tomllib.loads((resources.files("hil") / "data" / FILE).read_text(encoding="utf-8"))
    return {name: float(factor) for name, factor in table["factors"].items()}


def factors_of(free: Sequence[Free], factors: Mapping[str, float]) -> Floats:
    """Return the factor of each free number, (p,): that of its kind, else that of its section."""
    fields = [number.name.replace("spring_rise", "spring_closed") for number in free]
    return np.array([factors.get(field, factors[field.split(".")[0]]) for field in fields])


def deviations(values: Mapping[str, Floats], truth: Mapping[str, Floats], known: Intervals) -> dict[str, Floats]:
    """Return how far off each fitted number is in standard deviations of its interval, arrays by `section.field`.

    Args:
        values: fitted numbers.
        truth: what they are.
        known: 95 % intervals of the fitted numbers; entries without width are left out.
    """
    found = {}
    for name, (low, high) in known.items():
        fitted = (low < high) & (values[name] != 0.0)
        value, above, true = values[name][fitted], high[fitted], truth[name][fitted]
        if not name.endswith("take_up"):
            value, above, true = (np.log(np.abs(one)) for one in (value, above, true))
        found[name] = COVERAGE_SIGMA * np.abs(true - value) / np.abs(above - value)
    return found


def conformal_factor(off: Sequence[float]) -> float:
    """Return the factor with which intervals hold a further number in 95 of 100 cases, from what some were off by.

    Split conformal prediction: the k-th smallest of n, k = 0.95 (n + 1) rounded up, or the largest where n is too
    small for that. A factor below one is one.

    Args:
        off: standard deviations that numbers of one kind were off by.
    """
    k = min(math.ceil(COVERED * (len(off) + 1)), len(off))
    return max(1.0, float(np.sort(off)[k - 1]) / COVERAGE_SIGMA)
