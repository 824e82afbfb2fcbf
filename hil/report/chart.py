"""A chart as data: lines and dots over one scale, read on a scale at the left and perhaps another at the right.

`chart_svg` draws it. A page has two dozen charts, and Matplotlib takes 50 ms for the axes of each.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ticks = tuple[tuple[float, str], ...]
"""Where each tick stands, and what is written there."""

NICE = (1.0, 2.0, 2.5, 5.0, 10.0)
"""Distances of ticks, times a power of ten."""
MOST_TICKS = 7
SPARE = 0.05
"""Room at either end of a scale, part of what is shown."""


@dataclass(frozen=True)
class ChartTrace:
    """One line, one row of dots, or both."""

    across: Floats
    """(n,) float, never decreasing."""
    up: Floats
    """(n,) float."""
    colour: str
    """As `#rrggbb`."""
    dashes: tuple[float, ...] = ()
    """Lengths of dashes and gaps in turn, pt; an unbroken line when empty."""
    width: float = 1.1
    """Of the line, pt; 0 is none."""
    dot: float = 0.0
    """Diameter of a dot at every sample, pt; 0 is none."""
    steps: bool = False
    """Whether a value holds until the next one."""
    right: bool = False
    """Whether it is read on the right-hand scale."""
    label: str = ""
    """In the legend; not there when empty."""


@dataclass(frozen=True)
class Scale:
    """One axis."""

    low: float
    high: float
    ticks: Ticks
    label: str = ""
    line: bool = True
    """Whether the axis and its ticks are drawn, and not their texts alone."""


@dataclass(frozen=True)
class ChartBox:
    """A filled area behind the traces, in the units of the scales."""

    start: float
    end: float
    bottom: float
    top: float
    colour: str


@dataclass(frozen=True)
class Chart:
    """What is drawn."""

    across: Scale
    up: Scale
    traces: tuple[ChartTrace, ...]
    title: str = ""
    right: Scale | None = None
    boxes: tuple[ChartBox, ...] = ()


def fitted(values: Iterable[Floats], label: str = "") -> Scale:
    """Return the scale that shows all of `values`, with ticks at round numbers."""
    shown = np.concatenate([np.zeros(0), *values])
    low, high = (float(shown.min()), float(shown.max())) if shown.size else (0.0, 1.0)
    room = SPARE * (high - low) or 0.5
    return Scale(low - room, high + room, nice_ticks(low - room, high + room), label)


def nice_ticks(low: float, high: float) -> Ticks:
    """Return at most `MOST_TICKS` ticks at round numbers from `low` to `high`, which are apart."""
    least = (high - low) / (MOST_TICKS - 1)
    power = 10.0 ** math.floor(math.log10(least))
    step = next(nice * power for nice in NICE if nice * power >= least * (1.0 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return tuple((number * step, f"{number * step:.6g}") for number in range(first, last + 1))
