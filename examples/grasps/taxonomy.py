"""The 33 grasps, read from `grasps.toml`."""

from pathlib import Path
from typing import Any

from aero.channels import Channel
from aero_hil_toml import filled, parsed

from .grasp import Grasp


def _grasp(row: dict[str, Any]) -> Grasp:
    row["thing"] = row.pop("object")
    if "closing" in row:
        row["closing"] = [Channel[label.upper()] for label in row["closing"]]
    return filled(Grasp, row, f"grasp {row['number']}")


_TEXT = Path(__file__).with_name("grasps.toml").read_text("utf-8")
GRASPS = tuple(map(_grasp, parsed(_TEXT, "grasps.toml")["grasp"]))
"""In the taxonomy's order."""
