"""What an experiment writes into while it runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from hil.recordings.provenance import source_commit, versions
from hil.recordings.recording import Event, Header, Recording, Series, Severity
from hil.targets.target import Target

Progress = Callable[[float, str], None]
"""Called with the finished part (0..1) and what is being done."""

LABELS = tuple(channel.label for channel in Channel)
LENGTH_UNITS = tuple("rad" if channel is Channel.THUMB_ABDUCTION else "m" for channel in Channel)
REHEARSAL = "rehearsal_"
"""What the series of a policy's rehearsal begin with."""
_UNITS: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("command", "model", "hand", "goal", "travel"), LENGTH_UNITS),
    **dict.fromkeys(("codes", "command_codes"), ("u16",) * len(Channel)),
    "currents": ("A",) * len(Channel),
    "action": ("1",) * len(Channel),
    "temperatures": ("degC",) * len(Channel),
}
SERIES_UNITS = _UNITS | {REHEARSAL + name: units for name, units in _UNITS.items()}
"""Every series an experiment may leave, with the units of its seven columns."""


def silent(_done: float, _doing: str) -> None:
    """Report progress to nobody."""


class Recorder:
    """Collects the samples of one experiment on one target and turns them into a recording.

    Times given to it are times of the target's clock; those in the recording count from the recorder's making.
    """

    def __init__(self, target: Target, *, from_opening: bool = False) -> None:
        """Start now, or, for the bytes alone, at the opening of the target."""
        self._target = target
        self._times: dict[str, list[float]] = {}
        self._rows: dict[str, list[NDArray[Any]]] = {}
        self._events: list[Event] = []
        self._wire_mark = 0 if from_opening else target.wire.mark()
        self.start = target.wire.opened if from_opening else target.clock.now()
        """Time of the target's clock that is zero in the recording, s."""

    def add(self, name: str, t: float, row: NDArray[Any]) -> None:
        """Add one sample, (7,), taken at `t` (s on the target's clock), to a series of `SERIES_UNITS`."""
        self._times.setdefault(name, []).append(t - self.start)
        self._rows.setdefault(name, []).append(row)

    def has(self, name: str) -> bool:
        """Whether a series has a sample yet."""
        return name in self._rows

    def derive(self, name: str, source: str, convert: Callable[[NDArray[Any]], NDArray[Any]]) -> None:
        """Add a whole series, computed from all samples (n, 7) of another and at its times."""
        self._times[name] = self._times[source]
        self._rows[name] = list(convert(np.array(self._rows[source])))

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
            map=target.map.coefficients.name,
            window=target.map.window.name,
            unit=target.unit,
            seed=target.seed,
            parameters=dict(parameters),
            safety={} if target.guard is None else target.guard.thresholds.as_dict(),
            versions=versions(),
            commit=source_commit(),
        )
        series = {
            name: Series.of(LABELS, SERIES_UNITS[name], self._times[name], np.array(rows))
            for name, rows in self._rows.items()
        }
        return Recording(header, series, target.wire.since(self._wire_mark, self.start), tuple(self._events))
