"""The picture of docs/speed.md from `history.json`: `python bench/history.py` writes docs/speed.svg.

An entry of `history.json` is what `tox -e bench` printed at one commit, under `compiled` what `tox -e bench-compiled`
printed, and the load of the machine meanwhile.
"""

from __future__ import annotations

import json
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from hil.report.matplotlib_svg import STYLE, svg_of

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
STYLES = {"ratios": "o-", "compiled": ".:"}
"""Key of an entry to its line: pure Python, and the compiled wheel."""
MOST = 8.0
"""Ratio at the top of the picture."""


def history_svg() -> str:
    """Return the ratios of each row over the commits, as the text of an SVG file."""
    entries = json.loads((HERE / "history.json").read_text(encoding="utf-8"))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.5, 3.6), layout="constrained")
        axes = figure.subplots()
        for kind, style in STYLES.items():
            for name, colour in COLOURS.items():
                places = [i for i, entry in enumerate(entries) if name in entry.get(kind, {})]
                ratios = [entries[i][kind][name] for i in places]
                axes.plot(places, ratios, style, color=colour, markersize=4, label=name if kind == "ratios" else None)
        axes.set(xlabel="commit", ylabel="times the bare steps", ylim=(0.0, MOST))
        axes.set_xticks(range(len(entries)), [entry["commit"] for entry in entries])
        axes.legend(frameon=False, fontsize="small", ncols=2)
    return svg_of(figure)


if __name__ == "__main__":
    (HERE.parent / "docs" / "speed.svg").write_text(history_svg(), encoding="utf-8")
