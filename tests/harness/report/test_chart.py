"""Charts show every extreme, keep to their frame, and have round numbers on their scales."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from hil.report.chart import MOST_TICKS, Chart, ChartBox, ChartTrace, Scale, fitted, nice_ticks
from hil.report.chart_svg import INCH, chart_svg, sheet_svg

SVG = "{http://www.w3.org/2000/svg}"
RED = "#ff0000"


def drawn(svg, colour=RED):
    """Return the corners (n, 2) of the line of a colour, in tenths of a point."""
    path = next(p for p in ElementTree.fromstring(svg).iter(f"{SVG}path") if colour in p.get("style"))
    x, y, found = 0, 0, []
    for kind, *numbers in re.findall(r"([MHV]?)(-?\d+)(?: (-?\d+))?", path.get("d")):
        first, second = numbers
        x, y = (x, int(first)) if kind == "V" else (int(first), int(second) if second else y)
        found.append((x, y))
    return np.array(found)


def chart(across, up, **options):
    trace = ChartTrace(np.asarray(across, float), np.asarray(up, float), RED, **options)
    return Chart(fitted([trace.across], "time, s"), fitted([trace.up], "A"), (trace,))


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6))
@example(879609.9999999999, 1e-06)
def test_ticks_are_few_round_and_within(low, span):
    high = low + span
    ticks = [at for at, _ in nice_ticks(low, high)]
    assert 1 <= len(ticks) <= MOST_TICKS
    # A tick is no nearer to its place than floating point has numbers there.
    slack = 1e-6 * span + 4 * np.spacing(max(abs(low), abs(high)))
    assert low - slack <= ticks[0] <= ticks[-1] <= high + slack


@pytest.mark.parametrize(
    ("low", "high", "texts"),
    [
        (0.0, 1.0, ["0", "0.2", "0.4", "0.6", "0.8", "1"]),
        (-0.3, 13.0, ["0", "2.5", "5", "7.5", "10", "12.5"]),
        (60.1, 112.0, ["70", "80", "90", "100", "110"]),
    ],
)
def test_ticks_of_known_ranges(low, high, texts):
    assert [text for _, text in nice_ticks(low, high)] == texts


@pytest.mark.parametrize("steps", [False, True])
@given(st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=3000))
def test_extremes_are_drawn_and_nothing_leaves_the_frame(steps, values):
    found = drawn(chart_svg(chart(np.arange(len(values)), values, steps=steps)))
    assert found.min() > 0
    assert found[:, 0].max() < 4.6 * INCH
    assert found[:, 1].max() < 2.9 * INCH
    least, most = found[:, 1].max(), found[:, 1].min()
    scale = fitted([np.array(values)])
    share = (max(values) - min(values)) / (scale.high - scale.low)
    whole = drawn(chart_svg(chart([0, 1], [min(values), max(values)])))
    assert least - most == abs(whole[1, 1] - whole[0, 1]) or share < 1e-3


def test_a_spike_among_many_samples_is_drawn():
    values = np.zeros(100_000)
    values[54_321] = 1.0
    found = drawn(chart_svg(chart(np.arange(100_000), values)))
    assert len(found) < 20
    assert np.ptp(found[:, 1]) > INCH


def test_a_step_holds_until_the_next_sample():
    found = drawn(chart_svg(chart([0, 1, 2], [0, 1, 1], steps=True)))
    assert found[1, 0] == found[2, 0]
    assert found[1, 1] == found[0, 1]
    assert found[-1, 0] > found[-2, 0]


def test_what_lies_beyond_a_scale_is_cut():
    trace = ChartTrace(np.array([-1.0, 0.5, 9.0]), np.array([0.0, 5.0, 0.0]), RED, dot=2.0, width=0.0)
    assert chart_svg(Chart(Scale(0, 1, ()), Scale(0, 1, ()), (trace,))).count("h0") == 1


def test_texts_are_escaped_and_boxes_are_behind():
    scale = Scale(0, 1, ((0.5, "<b>"),), "a & b")
    svg = chart_svg(
        Chart(
            scale, scale, (ChartTrace(np.arange(2.0), np.arange(2.0), RED),), boxes=(ChartBox(0, 1, 0, 1, "#00ff00"),)
        )
    )
    texts = [text.text for text in ElementTree.fromstring(svg).iter(f"{SVG}text")]
    assert texts.count("<b>") == 2
    assert "a & b" in texts
    assert svg.index("#00ff00") < svg.index(RED)


def test_a_sheet_names_each_trace_once():
    one = chart([0, 1], [0, 1], label="hand")
    svg = sheet_svg([one, one, one], columns=2, width_inches=6.0, height_inches=6.0)
    assert svg.count(">hand</text>") == 1
    assert svg.count(RED) == 4
