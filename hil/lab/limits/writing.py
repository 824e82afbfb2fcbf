"""The limits file of a kind of hand, as text."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

from hil.verdict.limits import Limit

Provenance = Mapping[str, Any]
"""What made a file, and by its name what made an experiment's limits anew, as a table within."""


def limits_text(limits: Sequence[Limit], provenance: Provenance, *, extends: str = "") -> str:
    """Return limits as TOML that `load_limits` reads."""
    lines = ["# Made by `aero-hil limits`; change `checks.toml` or the population, and make it again."]
    if extends:
        lines.append(f"extends = {json.dumps(extends)}")
    tables = {name: value for name, value in provenance.items() if isinstance(value, Mapping)}
    own = {key: value for key, value in provenance.items() if key not in tables}
    for name, table in (("provenance", own), *((f"provenance.{name}", table) for name, table in tables.items())):
        lines += ["", f"[{name}]", *(f"{key} = {json.dumps(value)}" for key, value in table.items())]
    for limit in limits:
        bounds = {"at_least": limit.at_least, "at_most": limit.at_most}
        lines += [
            "",
            "[[limit]]",
            f"experiment = {json.dumps(limit.experiment)}",
            f"metric = {json.dumps(limit.metric)}",
            f"subjects = {json.dumps(list(limit.subjects))}",
            *([f"firmware = {json.dumps(list(limit.firmware))}"] if limit.firmware else []),
            *([f"guarded = {json.dumps(limit.guarded)}"] if limit.guarded is not None else []),
            *(f"{name} = {value:g}" for name, value in bounds.items() if math.isfinite(value)),
            *([f"healthy = [{limit.healthy[0]:g}, {limit.healthy[1]:g}]"] if limit.healthy else []),
            f"source = {json.dumps(limit.source)}",
        ]
    return "\n".join(lines) + "\n"
