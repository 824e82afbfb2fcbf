"""stub"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Target:
    name: str
    hand: Any
    clock: Any
    map: Any
    firmware: str
    side: str
    unit: str
    seed: int
    wire: Any
    reach: Any
