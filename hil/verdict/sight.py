"""What each check can see, as a campaign found: how often it accuses a healthy hand, and the faults that it finds."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from importlib import resources

from hil.faults.fault import quantity

FILE = "sight.json"
LISTED = 6
"""Faults that a sentence names."""


@dataclass(frozen=True)
class Seen:
    """A fault that a check found on every hand it was put into, from a severity on."""

    fault: str
    severity: float
    """The least that was tried and found on all."""
    unit: str
    hands: int
    """On which it was tried, and found."""


@dataclass(frozen=True)
class Sight:
    """What one check, `experiment/metric`, can see."""

    accused: int
    """Healthy hands that it accused."""
    healthy: int
    """Healthy hands that it judged."""
    at_most: float
    """Upper end of the interval, of 95 %, for the share of healthy hands that it accuses."""
    sees: tuple[Seen, ...]

    @property
    def sentence(self) -> str:
        """What the check is worth, in a sentence or two."""
        alarms = f"This check accused {self.accused} of {self.healthy} healthy hands (at most {self.at_most:.1%})."
        if not self.sees:
            return f"{alarms} It found no fault of the catalogue on every hand."
        faults = ", ".join(
            seen.fault.replace("_", " ") + (f" from {quantity(seen.severity, seen.unit)} on" if seen.unit else "")
            for seen in self.sees[:LISTED]
        )
        more = f" and {len(self.sees) - LISTED} more" if len(self.sees) > LISTED else ""
        return f"{alarms} It found on every hand that had it: {faults}{more}."


@cache
def load_sight() -> Mapping[str, Sight]:
    """Return what ships: check, `experiment/metric`, to what it can see."""
    table = json.loads((resources.files("hil") / "data" / FILE).read_text(encoding="utf-8"))
    return {
        check: Sight(**{**row, "sees": tuple(Seen(**seen) for seen in row["sees"])})
        for check, row in table["checks"].items()
    }


def sight_text(sights: Mapping[str, Sight], provenance: Mapping[str, str | int | list[str]]) -> str:
    """Return sights as JSON."""
    checks = {check: asdict(sight) for check, sight in sorted(sights.items())}
    return json.dumps({"provenance": provenance, "checks": checks}, indent=1) + "\n"
