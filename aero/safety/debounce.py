"""How long something has been so."""

from __future__ import annotations

from collections.abc import Hashable


class Debounce:
    """Remembers since when each of several conditions has held, from looks at discrete times."""

    def __init__(self) -> None:
        self._since: dict[Hashable, float] = {}

    def seconds(self, what: Hashable, holds: bool, t: float) -> float:
        """Return for how long `what` has held at `t` (s), from the first look that saw it; -1 when it does not."""
        if not holds:
            self._since.pop(what, None)
            return -1.0
        return t - self._since.setdefault(what, t)

    def clear(self) -> None:
        """Begin anew."""
        self._since.clear()
