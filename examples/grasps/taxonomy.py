"""The 33 grasps, read from `grasps.toml`."""

from __future__ import annotations

from pathlib import Path

from .store import read_grasps

TABLE = Path(__file__).with_name("grasps.toml")
GRASPS = read_grasps(TABLE)
"""In the taxonomy's order."""
