"""The picture of docs/speed.md from `history.json`: `python bench/history.py` writes docs/speed.svg.

An entry of `history.json` is what `tox -e bench` printed at one commit, under `compiled` what `tox -e bench-compiled`
printed, and the load of the machine meanwhile.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from hil.report.chart import Chart, ChartTrace, Scale, nice_ticks
from hil.report.chart_svg import chart_svg

HERE = Path(__file__).parent
COLOURS = {
    "staircase of 3 levels": "#1f4e9c",
    "idle": "#c0392b",
    "staircase": "#777777",
    "stream at 20 Hz": "#2b2b2b",
    "stream at 100 Hz": "#1c7a43",
    "validate, files, report": "#9a6700",
}
"""Rows that are drawn."""
STYLES = {"ratios": (4.0, ()), "compiled": (2.5, (2.0, 2.0))}
"""Key of an entry to dot and dashes, pt: pure Python, and the compiled wheel."""
MOST = 8.0
"""Ratio at the top of the picture."""


def history_svg() -> str:
    """Return the ratios of each row over the commits, as the text of an SVG file."""
    entries = json.loads((HERE / "history.json").read_text(encoding="utf-8"))
    traces = []
    for kind, (dot, dashes) in STYLES.items():
        for name, colour in COLOURS.items():
            places = [i for i, entry in enumerate(entries) if name in entry.get(kind, {})]
            ratios = np.array([entries[i][kind][name] for i in places])
            label = name if kind == "ratios" else ""
            traces.append(ChartTrace(np.array(places, float), ratios, colour, dashes, dot=dot, label=label))
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
