"""Take `baseline.json` anew: `tox -e bench`, three times.

`PYTHONPATH=docs python bench/take_baseline.py [-k ROW]` takes all rows, or some; it needs tox and the extra `figures`.
A ratio is the median of its three runs. Its band is 15 % where the three lie within that of one another, else what they
differ by. The table of docs/speed.md is written anew.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

from figures import Rows, store

HERE = Path(__file__).parent
RUNS = 3
BAND = 0.15
STEP = 0.05
"""What a wider band is a multiple of."""

ROWS = {
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
"""Row of the baseline to its words in docs/speed.md, its test, and its aim."""

Ratios = dict[str, list[float]]
"""Row to its ratio in each run."""


def band_of(ratios: list[float]) -> float:
    """Return how much worse than the median a later run may be, as a part of it."""
    apart = max(ratios) / min(ratios) - 1.0
    return BAND if apart <= BAND else round(STEP * math.ceil(apart / STEP), 2)


def run(path: Path, options: list[str], *, built: bool) -> dict[str, float]:
    """Measure once; return row to ratio, whether or not it keeps to the baseline."""
    again = ["--skip-pkg-install"] if built else []
    command = ["tox", "run", "-e", "bench", *again, "--", f"--benchmark-json={path}", *options]
    subprocess.run(command, cwd=HERE.parent, check=False)
    rows = json.loads(path.read_text(encoding="utf-8"))["benchmarks"]
    return {row["extra_info"]["row"]: row["extra_info"]["ratio"] for row in rows}


def table(baseline: dict[str, Any]) -> Rows:
    """Return the table of docs/speed.md: processor time of the emulated hand over that of its physics alone."""
    rows = [["what", "ratio", "aim", "command"]]
    for name, (words, test, aim) in ROWS.items():
        row = baseline["ratios"].get(name)
        ratio = f"{row['ratio']:.2f} ({row['band']:.0%})".replace("%", " %") if row else "not taken"
        rows.append([words, ratio, "" if aim is None else f"{aim:.1f}", f"`tox -e bench -- -k {test}`"])
    return rows


def main(options: list[str]) -> None:
    """Measure, and write what was measured beside what is kept of other rows."""
    ratios: dict[str, Ratios] = {}
    loads = []
    with TemporaryDirectory() as folder:
        for turn in range(RUNS):
            for row, ratio in run(Path(folder) / f"{turn}.json", options, built=turn > 0).items():
                ratios.setdefault(row, []).append(ratio)
            loads.append(os.getloadavg()[0])
    load = f"{min(loads):.0f} to {max(loads):.0f} on {os.cpu_count()} cores"
    commit = subprocess.run(
        ["git", "describe", "--always", "--exclude=*"], cwd=HERE, capture_output=True, text=True, check=True
    ).stdout.strip()
    baseline = json.loads((HERE / "baseline.json").read_text(encoding="utf-8"))
    for row, of_runs in ratios.items():
        baseline["ratios"][row] = {"ratio": round(median(of_runs), 2), "band": band_of(of_runs)}
    baseline["origin"] = f"commit {commit}, load {load}"
    (HERE / "baseline.json").write_text(json.dumps(baseline, indent=2) + "\n", encoding="utf-8")
    store("speed.ratios", table(baseline), origin=f"{baseline['origin']}; in `bench/baseline.json`")
    subprocess.run([sys.executable, "-m", "figures"], cwd=HERE.parent, check=True)


if __name__ == "__main__":
    main(sys.argv[1:])
