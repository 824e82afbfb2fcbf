"""The picture of docs/speed.md from `history.json`: `python bench/history.py` writes docs/speed.svg.

An entry of `history.json` is what `tox -e bench` printed at one commit, and the load of the machine meanwhile.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from hil.report.chart import Chart, ChartTrace, Scale, nice_ticks
from hil.report.chart_svg import chart_svg

HERE = Path(__file__).parent
COLOURS = ("#1f4e9c", "#c0392b", "#777777", "#2b2b2b", "#1c7a43", "#9a6700")
MOST = 7.0
"""Ratio at the top of the picture."""


def history_svg() -> str:
    """Return the ratios of each row over the commits, as the text of an SVG file."""
    entries = json.loads((HERE / "history.json").read_text(encoding="utf-8"))
    names = dict.fromkeys(name for entry in entries for name in entry["ratios"])
    traces = []
    for name, colour in zip(names, COLOURS, strict=True):
        places = [i for i, entry in enumerate(entries) if name in entry["ratios"]]
        ratios = np.array([entries[i]["ratios"][name] for i in places])
        traces.append(ChartTrace(np.array(places, float), ratios, colour, dot=4.0, label=name))
    last = len(entries) - 1
    return chart_svg(
        Chart(
            across=Scale(-0.2, last + 0.2, tuple((float(i), e["commit"]) for i, e in enumerate(entries)), "commit"),
            up=Scale(0.0, MOST, nice_ticks(0.0, MOST), "times the bare steps"),
            traces=tuple(traces),
        ),
        width_inches=9.5,
        height_inches=3.6,
    )


if __name__ == "__main__":
    (HERE.parent / "docs" / "speed.svg").write_text(history_svg(), encoding="utf-8")
