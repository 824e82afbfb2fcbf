"""What is checked, as data: `hil/checks/checks.toml`. Limits are computed from it and from healthy hands."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from importlib import resources
from typing import Any, Literal

Side = Literal["above", "below", "both"]


@dataclass(frozen=True)
class Check:
    """One metric that is judged, on subjects whose readings are alike."""

    experiment: str
    metric: str
    subjects: tuple[str, ...]
    """Pooled: one limit holds for all."""
    firmware: tuple[str, ...] = ()
    """Versions it holds for; empty for all."""
    side: Side | None = None
    """Which side of the healthy readings is a fault; None when the bound is given."""
    floor: float = 0.0
    """Least distance of a limit from any healthy reading, in the metric's unit."""
    recorded: tuple[float, float] | None = None
    """Least and greatest reading of physical hands, which the limits hold."""
    recorded_by: str = ""
    at_least: float = -math.inf
    """Bound that physics or the wire gives."""
    at_most: float = math.inf
    source: str = ""
    """Of that bound."""

    @property
    def given(self) -> bool:
        """Whether the bound is given, and not computed."""
        return self.side is None


def load_checks() -> tuple[Check, ...]:
    """Return all checks.

    Raises:
        ValueError: the file has a mistake; the message names the metric.
    """
    text = (resources.files("hil.checks") / "checks.toml").read_text(encoding="utf-8")
    return tuple(parse_check(table) for table in tomllib.loads(text)["check"])


def parse_check(table: Mapping[str, Any]) -> Check:
    """Make a check of one table of the file.

    Raises:
        ValueError: a key is unknown, or it has neither a side nor a bound with its source.
    """
    name = table.get("metric", "?")
    if unknown := table.keys() - {field.name for field in fields(Check)}:
        raise ValueError(f"check on {name}: unknown keys {sorted(unknown)}")
    lists = {key: tuple(table[key]) for key in ("subjects", "firmware", "recorded") if key in table}
    check = Check(**{**table, **lists})
    bounded = math.isfinite(check.at_least) or math.isfinite(check.at_most)
    if check.given != bounded or check.given != bool(check.source):
        raise ValueError(f"check on {name}: give a side, or at_least or at_most with a source")
    if not check.given and not check.floor > 0:
        raise ValueError(f"check on {name}: give the least distance from healthy readings, `floor`")
    return check
