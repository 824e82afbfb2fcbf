"""How far the guard's promises were from being broken in a run, for its page and its command."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from hil.recordings.recording import Recording
from hil.verdict.margins import Margin, available, margins


@dataclass(frozen=True)
class MarginLeft:
    """The smallest margin of one promise."""

    margin: Margin
    experiment: str
    """In whose recording it was."""

    @property
    def text(self) -> str:
        """The margin with its unit."""
        return f"{self.margin.value:.3g} {self.margin.promise.unit}" if self.margin.tested else "not put to the test"


def margins_left(recordings: Iterable[Recording]) -> tuple[MarginLeft, ...]:
    """Return the smallest margin of each promise over recordings of guarded hands; none without extra `promises`."""
    if not available():
        return ()
    smallest: dict[str, MarginLeft] = {}
    for recording in recordings:
        for found in margins(recording):
            before = smallest.get(found.promise.name)
            if before is None or found.value < before.margin.value:
                smallest[found.promise.name] = MarginLeft(found, recording.header.experiment)
    return tuple(smallest.values())


def nearest(left: Iterable[MarginLeft]) -> str:
    """Return one line about the promise that came nearest to being broken, empty when there is none."""
    tested: Mapping[float, MarginLeft] = {one.margin.share: one for one in left if one.margin.tested}
    if not tested:
        return ""
    one = tested[min(tested)]
    return f"the guard's promise that came nearest to being broken: {one.margin.promise.name}, {one.text} left"
