"""Table of docs/speed.md, from the baseline that `tox -e bench` checks."""

from __future__ import annotations

import json

from figures.cells import Cell
from figures.pages import ROOT
from figures.sources import Cost, Row, Source
from figures.stored import STORED

MEASURED = {
    "staircase of 3 levels": (
        "staircase of 3 levels, both hands, wire and recording in memory",
        "short_staircase",
        None,
    ),
    "staircase": ("staircase, the same", "test_staircase", 2.0),
    "idle": ("emulated hand idle, 10 s", "idle", 1.5),
    "stream at 20 Hz": ("reading and commanding at 20 Hz, 10 s", "stream", 2.0),
    "stream at 100 Hz": ("the same at 100 Hz", "stream", 3.5),
    "one validation of a campaign": ("all experiments, without files", "campaign", None),
    "validate, files, report": ("`validate` with files and report", "files", 3.0),
    "validate --help": ("`validate --help`, beside a bare start", "test_help", 1.2),
    "GET_POS on a pseudo-terminal": ("`GET_POS` on a pseudo-terminal, beside echo and modelled time", "get_pos", 1.3),
}
"""Name in the baseline to what it is, its test, and what it is to reach."""
BASELINE = json.loads((ROOT / "bench" / "baseline.json").read_text(encoding="utf-8"))


def ratios() -> list[Row]:
    """Processor time of the emulated hand over that of its physics alone."""
    return [
        ("what", "pure", "compiled", "aim", "command"),
        *(
            (
                what,
                _ratio("pure", name),
                _ratio("compiled", name),
                "" if aim is None else f"{aim:.1f}",
                f"`tox -e bench -- -k {test}`",
            )
            for name, (what, test, aim) in MEASURED.items()
        ),
    ]


def _ratio(kind: str, name: str) -> Cell | str:
    row = BASELINE[kind].get(name)
    return Cell.of("{:.2f} ({:.0f} %)", row["ratio"], 100.0 * row["band"]) if row else "not taken"


TABLES = {
    "ratios": Source(
        ratios,
        "`python bench/take_baseline.py`",
        STORED,
        Cost.STORED,
        origin=f"{BASELINE['origin']}; kept in `bench/baseline.json`",
    )
}
