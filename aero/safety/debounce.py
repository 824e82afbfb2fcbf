"""How long something has been so, told from looks at discrete times."""

from __future__ import annotations

from collections.abc import Hashable


class Debounce:
    """Remembers for how long each of several conditions has been seen.

    The time between two looks counts up to `most_gap_s` (s): what was so before and after a pause of the program was
    not therefore so meanwhile.
    """

    def __init__(self, most_gap_s: float) -> None:
        self._most_gap_s = most_gap_s
        self._seen: dict[Hashable, tuple[float, float]] = {}

    def seconds(self, what: Hashable, holds: bool, t: float) -> float:
        """Return for how long `what` has held at `t` (s), from the first look that saw it; -1 when it does not."""
        if not holds:
            self._seen.pop(what, None)
            return -1.0
        before, held = self._seen.get(what, (t, 0.0))
        held += min(t - before, self._most_gap_s)
        self._seen[what] = t, held
        return held

    def clear(self) -> None:
        """Begin anew."""
        self._seen.clear()
