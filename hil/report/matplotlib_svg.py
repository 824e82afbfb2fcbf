"""Matplotlib figures as SVG in a common style."""

import io
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

STYLE: Any = {  # matplotlib types the keys as one literal each
    "font.size": 9,
    "axes.spines.top": False,
    "axes.linewidth": 0.8,
    "lines.linewidth": 1.1,
    "svg.fonttype": "none",
    "svg.hashsalt": "aero-hil",
    "path.simplify_threshold": 0.5,
}


def svg_of(figure: Figure) -> str:
    """Return a figure as a reproducible SVG element with text as text, not as paths."""
    out = io.StringIO()
    with mpl.rc_context(STYLE):
        figure.savefig(out, format="svg", metadata={"Date": None})
    text = out.getvalue()
    return text[text.index("<svg") :]
