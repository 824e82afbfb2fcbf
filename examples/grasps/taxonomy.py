"""The 33 grasps, read from `grasps.toml`."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from aero.channels import Channel

from .grasp import FREE, Grasp
from .object_plant import HeldObject


def _grasp(row: dict[str, Any]) -> Grasp:
    thing = row.pop("object")
    closing = tuple(Channel[label.upper()] for label in row.pop("closing", ())) or FREE
    lists = {key: tuple(value) for key, value in row.items() if isinstance(value, list)}
    solid = HeldObject(thing["shape"], tuple(thing["size_mm"]), thing["mass_kg"])
    return Grasp(**row | lists, thing=solid, closing=closing)


GRASPS = tuple(map(_grasp, tomllib.loads(Path(__file__).with_name("grasps.toml").read_text("utf-8"))["grasp"]))
"""In the taxonomy's order."""
