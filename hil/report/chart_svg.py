"""Charts as SVG, text kept as text; the same chart gives the same bytes.

Lengths on paper are tenths of a point, so that coordinates are whole numbers. A line shows, of all samples that fall
into one column of half a point, the first, the last, the least and the greatest.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache
from math import ceil

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from numpy.typing import NDArray

from hil.report.chart import Chart, ChartTrace, Scale

INK = "#000000"
INCH = 720
POINT = 10
TEXT, TITLE = 90, 100
"""Sizes of letters."""
LETTER = 0.6
"""Mean width of a letter, part of its size."""
GAP = 30
"""Between a tick, its text and what comes next."""
TICK = 35
COLUMN = 5
SAMPLE = 200
"""Length of the line beside a name in a legend."""
AXIS_WIDTH = 8

Ints = NDArray[np.int64]
Values = Sequence[float] | NDArray[np.float64]


@dataclass(frozen=True)
class Path:
    """A line, or dots, which are lines of no length with round ends."""

    d: str
    colour: str
    width: int
    dashes: str = ""
    rounded: bool = False
    """Whether its ends are."""


@dataclass(frozen=True)
class Text:
    """Something written."""

    x: int
    y: int
    text: str
    anchor: str = "middle"
    size: int = TEXT
    turned: bool = False
    """Whether it is read from the bottom to the top."""


@dataclass
class Sheet:
    """One chart on paper, its corner at `x`, `y`."""

    x: int = 0
    y: int = 0
    areas: list[tuple[str, str]] = field(default_factory=list)
    """Outline and colour of each area."""
    paths: list[Path] = field(default_factory=list)
    texts: list[Text] = field(default_factory=list)


def chart_svg(chart: Chart, *, width_inches: float = 4.6, height_inches: float = 2.9) -> str:
    """Return a chart as an SVG element, the names of its traces above one that has no title."""
    width, height = round(width_inches * INCH), round(height_inches * INCH)
    sheet = _drawn(chart, width, height)
    if not chart.title:
        _legend(sheet, chart.traces, GAP, GAP + TEXT)
    return _svg([sheet], width, height)


def sheet_svg(charts: Sequence[Chart], *, columns: int, width_inches: float, height_inches: float) -> str:
    """Return charts in rows, from left to right, as one SVG element, the names of their traces below them."""
    width, height = round(width_inches * INCH), round(height_inches * INCH)
    each = width // columns, (height - 3 * TEXT) // ceil(len(charts) / columns)
    sheets = [_drawn(chart, *each, i % columns * each[0], i // columns * each[1]) for i, chart in enumerate(charts)]
    below = Sheet(width // 3, height - 2 * TEXT)
    _legend(below, charts[0].traces, 0, TEXT)
    return _svg([*sheets, below], width, height)


def _drawn(chart: Chart, width: int, height: int, x: int = 0, y: int = 0) -> Sheet:
    sheet = Sheet(x, y)
    headed = chart.title or any(trace.label for trace in chart.traces)
    left, right = _beside(chart.up), width - (_beside(chart.right) if chart.right else 2 * GAP)
    top, bottom = (TITLE if headed else 0) + 2 * GAP, height - TICK - 2 * TEXT - 3 * GAP

    def across(values: Values) -> Ints:
        return _placed(values, chart.across, left, right)

    def up(values: Values, scale: Scale) -> Ints:
        return _placed(values, scale, bottom, top)

    for box in chart.boxes:
        (x0, x1), (y0, y1) = across([box.start, box.end]), up([box.bottom, box.top], chart.up)
        sheet.areas.append((f"M{x0} {y0}H{max(x1, x0 + 1)}V{y1}H{x0}Z", box.colour))
    for trace in chart.traces:
        shown = (trace.across >= chart.across.low) & (trace.across <= chart.across.high)
        if shown.any():
            scale = chart.right if trace.right and chart.right else chart.up
            sheet.paths += _paths(trace, across(trace.across[shown]), up(trace.up[shown], scale))
    if chart.title:
        sheet.texts.append(Text(left, TITLE + GAP, chart.title, "start", TITLE))
    _across(sheet, chart.across, across([at for at, _ in chart.across.ticks]), (left, right), bottom)
    _upright(sheet, chart.up, up([at for at, _ in chart.up.ticks], chart.up), (top, bottom), left, side=-1)
    if chart.right is not None:
        places = up([at for at, _ in chart.right.ticks], chart.right)
        _upright(sheet, chart.right, places, (top, bottom), right, side=1)
    return sheet


def _beside(scale: Scale) -> int:
    """Return the room that the texts of an upright scale take."""
    longest = max((len(text) for _, text in scale.ticks), default=0)
    label = TEXT + GAP if scale.label else 0
    return round(LETTER * TEXT * longest) + TICK + 2 * GAP + label


def _placed(values: Values, scale: Scale, start: int, end: int) -> Ints:
    """Return where values of a scale lie between two places, those beyond it at its ends."""
    shares = (np.asarray(values, float) - scale.low) / (scale.high - scale.low)
    return np.rint(start + np.clip(shares, 0.0, 1.0) * (end - start)).astype(int)


def _across(sheet: Sheet, scale: Scale, places: Ints, ends: tuple[int, int], y: int) -> None:
    ticks = "".join(f"M{at} {y}v{TICK}" for at in places)
    sheet.paths.append(Path(f"M{ends[0]} {y}H{ends[1]}{ticks}", INK, AXIS_WIDTH))
    for at, (_, text) in zip(places, scale.ticks, strict=True):
        sheet.texts.append(Text(int(at), y + TICK + GAP + TEXT, text))
    sheet.texts.append(Text(sum(ends) // 2, y + TICK + 2 * GAP + 2 * TEXT, scale.label))


def _upright(sheet: Sheet, scale: Scale, places: Ints, ends: tuple[int, int], x: int, *, side: int) -> None:
    """Add a scale whose texts stand at the left (`side` -1) or at the right (1) of `x`."""
    if scale.line:
        ticks = "".join(f"M{x} {at}h{side * TICK}" for at in places)
        sheet.paths.append(Path(f"M{x} {ends[1]}V{ends[0]}{ticks}", INK, AXIS_WIDTH))
    for at, (_, text) in zip(places, scale.ticks, strict=True):
        sheet.texts.append(Text(x + side * (TICK + GAP), int(at) + TEXT // 3, text, "end" if side < 0 else "start"))
    if scale.label:
        far = x + side * (_beside(scale) - GAP) + (TEXT if side < 0 else 0)
        sheet.texts.append(Text(far, sum(ends) // 2, scale.label, turned=True))


def _paths(trace: ChartTrace, x: Ints, y: Ints) -> list[Path]:
    found = []
    if trace.width:
        dashes = " ".join(f"{POINT * length:g}" for length in trace.dashes)
        d = _steps(x, y) if trace.steps else _line(x, y)
        found.append(Path(d, trace.colour, round(POINT * trace.width), dashes))
    if trace.dot:
        dots = dict.fromkeys(zip(x.tolist(), y.tolist(), strict=True))
        d = "".join(f"M{at} {height}h0" for at, height in dots)
        found.append(Path(d, trace.colour, round(POINT * trace.dot), rounded=True))
    return found


def _kept(x: Ints, y: Ints) -> tuple[Ints, Ints]:
    """Return the first, last, least and greatest sample of each column."""
    columns = x // COLUMN
    order = np.lexsort((y, columns))
    starts = np.flatnonzero(np.diff(columns, prepend=columns[0] - 1))
    ends = np.append(starts[1:], len(x)) - 1
    kept = np.unique(np.concatenate([starts, ends, order[starts], order[ends]]))
    return x[kept], y[kept]


def _line(x: Ints, y: Ints) -> str:
    x, y = _kept(x, y)
    bent = np.ones(len(y), bool)
    bent[1:-1] = (y[1:-1] != y[:-2]) | (y[1:-1] != y[2:])
    return "M" + " ".join(map(str, np.column_stack([x, y])[bent].ravel().tolist()))


def _steps(x: Ints, y: Ints) -> str:
    end = x[-1]
    x, y = _kept(x, y)
    changed = np.flatnonzero(np.diff(y)) + 1
    steps = "".join(f"H{at}V{to}" for at, to in zip(x[changed].tolist(), y[changed].tolist(), strict=True))
    return f"M{x[0]} {y[0]}{steps}H{end}"


def _legend(sheet: Sheet, traces: Iterable[ChartTrace], x: int, y: int) -> None:
    """Add the names of traces in a row, each behind a piece of its line."""
    for trace in traces:
        if trace.label:
            sheet.paths += _paths(trace, np.linspace(x, x + SAMPLE, 4, dtype=int), np.full(4, y - TEXT // 3))
            sheet.texts.append(Text(x + SAMPLE + GAP, y, trace.label, "start"))
            x += SAMPLE + 2 * GAP + round(LETTER * TEXT * len(trace.label))


@cache
def _template() -> Template:
    environment = Environment(
        loader=PackageLoader("hil.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("chart.svg.j2")


def _svg(sheets: Sequence[Sheet], width: int, height: int) -> str:
    return _template().render(sheets=sheets, width=width, height=height, point=POINT)
