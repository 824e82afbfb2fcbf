"""Table of docs/speed.md, from the baseline that `tox -e bench` checks."""

from __future__ import annotations

import json

from figures.cells import Cell
from figures.pages import ROOT
from figures.sources import Cost, Row, Source
from figures.stored import STORED

MEASURED = {
    "staircase of 3 levels": ("staircase of 3 levels, both hands, wire and recording in memory", "short_staircase"),
    "idle": ("emulated hand idle, 10 s", "idle"),
}
"""Name in the baseline to what it is, and its test."""


def ratios() -> list[Row]:
    """Processor time of the emulated hand over that of its physics alone."""
    baseline = json.loads((ROOT / "bench" / "baseline.json").read_text(encoding="utf-8"))
    return [
        ("what", "times the bare steps", "band", "command"),
        *(
            (
                what,
                Cell.of("{:.2f}", baseline[name]["ratio"]),
                Cell.of("{:.0f} %", 100.0 * baseline[name]["band"]),
                f"`tox -e bench -- -k {test}`",
            )
            for name, (what, test) in MEASURED.items()
        ),
    ]


TABLES = {
    "ratios": Source(
        ratios, "`tox -e bench`", STORED, Cost.STORED, origin="commit a406344; kept in `bench/baseline.json`"
    )
}
