"""Grasps as rows of TOML: the table `grasps.toml`, and what a search has found so far, a file a grasp."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from aero.channels import Channel
from aero.whole_file import write_whole

from .grasp import FREE, Grasp
from .object_plant import HeldObject


def read_grasps(path: Path) -> tuple[Grasp, ...]:
    """Return the grasps of a file, in its order."""
    return tuple(map(_grasp, tomllib.loads(path.read_text("utf-8"))["grasp"]))


def write_grasps(grasps: Sequence[Grasp], path: Path) -> None:
    """Write grasps, so that `read_grasps` returns them; the comment at the head of a file that is there is kept."""
    old = path.read_text("utf-8") if path.exists() else ""
    head = "".join(f"{line}\n" for line in old.partition("[[grasp]]")[0].splitlines() if line.startswith("#"))
    write_whole(path, "\n".join([*([head] if head else []), *map(_row, grasps)]))


def _grasp(row: dict[str, Any]) -> Grasp:
    thing = row.pop("object")
    closing = tuple(Channel[label.upper()] for label in row.pop("closing", ())) or FREE
    lists = {key: tuple(value) for key, value in row.items() if isinstance(value, list)}
    solid = HeldObject(thing["shape"], tuple(thing["size_mm"]), thing["mass_kg"])
    return Grasp(**row | lists, thing=solid, closing=closing)


def _row(grasp: Grasp) -> str:
    thing = grasp.thing
    edges = ", ".join(f"{edge:g}" for edge in thing.size_mm)
    values: dict[str, Any] = {
        "number": grasp.number,
        "name": grasp.name,
        "kind": grasp.kind,
        "object": None,
        "centre_mm": grasp.centre_mm,
        "axis": grasp.axis,
        "closure": grasp.closure,
        "touching": grasp.touching,
        "closing": [channel.label for channel in grasp.closing] if grasp.closing != FREE else None,
        "aperture": grasp.aperture,
        "delays_s": grasp.delays_s if any(grasp.delays_s) else None,
        "margin": grasp.margin,
    }
    lines = [f"{key} = {json.dumps(value)}" for key, value in values.items() if value is not None]
    lines.insert(3, f'object = {{ shape = "{thing.shape}", size_mm = [{edges}], mass_kg = {thing.mass_kg:g} }}')
    return "\n".join(["[[grasp]]", *lines]) + "\n"
