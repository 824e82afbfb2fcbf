"""A fault that was injected."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Active:
    """A fault that was injected, before and after it begins."""

    begin: Callable[[], object]
    """Lets it have its effect from now on."""
    clear: Callable[[], object] | None = None
    """Takes it away; None for what cannot be undone, such as a restart."""
