"""What an experiment writes into while it runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from hil.recording import Event, Header, Recording, Series, Severity, source_commit, versions
from hil.target import Target

Progress = Callable[[float, str], None]
"""Called with the finished part (0..1) and what is being done."""

LABELS = tuple(channel.label for channel in Channel)
LENGTH_UNITS = tuple("rad" if channel is Channel.THUMB_ABDUCTION else "m" for channel in Channel)
"""Units of simulator lengths and of cable travel, in command order."""


def units(unit: str) -> tuple[str, ...]:
    """Return one unit for all seven channels."""
    return (unit,) * len(Channel)


def silent(_done: float, _doing: str) -> None:
    """Report progress to nobody."""


class Recorder:
    """Collects the samples of one experiment on one target and turns them into a recording.

    Times given to it are times of the target's clock; those in the recording count from the recorder's making.
    """

    def __init__(self, target: Target, series: Mapping[str, tuple[str, ...]]) -> None:
        """Start now; `series` maps each series to the units of its seven columns."""
        self._target = target
        self._units = dict(series)
        self._rows: dict[str, list[tuple[float, list[float]]]] = {name: [] for name in series}
        self._events: list[Event] = []
        self._wire_mark = target.wire.mark()
        self.start = target.clock.now()
        """Time of the target's clock that is zero in the recording, s."""

    def add(self, name: str, t: float, row: NDArray[np.generic]) -> None:
        """Add one sample, (7,), taken at `t` (s on the target's clock)."""
        self._rows[name].append((t - self.start, row.tolist()))

    def note(self, text: str, severity: Severity = "info") -> None:
        """Add an event that happens now."""
        self._events.append(Event(self._target.clock.now() - self.start, severity, text))

    def finish(self, experiment: str, parameters: Mapping[str, float | str]) -> Recording:
        """Return the recording of everything since the recorder was made."""
        target = self._target
        header = Header(
            experiment=experiment,
            target=target.name,
            hand=target.side,
            firmware=target.firmware,
            map=target.map.describe(),
            unit=target.unit,
            seed=target.seed,
            parameters=dict(parameters),
            versions=versions(),
            commit=source_commit(),
        )
        series = {
            name: Series.of(LABELS, self._units[name], [t for t, _ in rows], [row for _, row in rows])
            for name, rows in self._rows.items()
            if rows
        }
        return Recording(header, series, target.wire.since(self._wire_mark, self.start), tuple(self._events))
