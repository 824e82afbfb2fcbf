"""The interactive plots of a report: which readings the page carries, and which of them each plot shows at first."""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass

import numpy as np

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.recordings.recording import Recording, Series
from hil.recordings.wire_file import with_series

SCALES = {
    "command_codes": 100.0 / MAX_CODE,
    "codes": 100.0 / MAX_CODE,
    "currents": 1e-3,
    "temperatures": 0.1,
    "command": 1e-3,
    "model": 1e-3,
    "hand": 1e-3,
}
"""Series that are drawn, to the size of one step of the page's whole numbers: % of window, A, °C, mm and mrad."""
READ_AS = {"codes": 1.0, "command_codes": 1.0, "currents": 1e3, "temperatures": 10.0}
"""From a series' unit to those steps; lengths (m, rad) in thousandths of a mm or mrad."""
ROWS = ("position", "error", "current", "temperature", "length", "difference")
"""What `templates/plots.js` can draw of a recording, from top to bottom; it leaves out what was not recorded."""


@dataclass(frozen=True)
class PlotColumn:
    """Some channels over some seconds."""

    channels: tuple[int, ...]
    start: float
    """s"""
    end: float
    title: str = ""
    mark: tuple[float, float] | None = None
    """Seconds to shade."""
    at: float | None = None
    """Instant to mark with a line, s."""
    zero: float = 0.0
    """Instant that counts as zero where columns are drawn together, s."""


@dataclass(frozen=True)
class Plot:
    """One figure of the page: rows over columns, with one time axis for each column."""

    name: str
    """Unique on the page; what links point at."""
    experiment: str
    rows: tuple[str, ...]
    columns: tuple[PlotColumn, ...]
    together: bool = False
    """Whether all columns are drawn on one time axis, each counted from its own zero."""

    @property
    def json(self) -> str:
        """The figure as `templates/plots.js` reads it."""
        return json.dumps(asdict(self))


def has_samples(recording: Recording, series: str) -> bool:
    """Return whether a recording has a series with samples: a damaged one may not."""
    return series in recording.series and recording[series].times.size > 0


def drawable(recording: Recording) -> bool:
    """Return whether a recording has anything that is drawn."""
    return any(has_samples(recording, name) for name in SCALES)


def with_samples(recording: Recording) -> Recording:
    """Return a recording with something to draw: where no series was recorded, what is in the frames of its bytes."""
    return recording if drawable(recording) else with_series(recording)


def duration_s(recording: Recording) -> float:
    """Return the time of the last sample, s; 0 without samples."""
    return max((float(series.times[-1]) for series in recording.series.values() if series.times.size), default=0.0)


def whole(recording: Recording, channels: Iterable[Channel]) -> Plot:
    """Return the plot of a whole recording, of which the reader chooses the channels."""
    name = recording.header.experiment
    return Plot(f"plot-{name}", name, ROWS, (PlotColumn(tuple(channels), 0.0, duration_s(recording)),))


def packed(recordings: Mapping[str, Recording]) -> str:
    """Return the readings of all recordings as the page holds them: whole numbers, differences, JSON, zlib, base64.

    Full resolution; a validation takes about 75 kB.
    """
    series = {
        name: {key: _steps(key, recording[key]) for key in SCALES if has_samples(recording, key)}
        for name, recording in recordings.items()
    }
    content = {"channels": [channel.title for channel in Channel], "series": series}
    return base64.b64encode(zlib.compress(json.dumps(content, separators=(",", ":")).encode(), 6)).decode()


def _steps(name: str, series: Series) -> dict[str, object]:
    finite = np.nan_to_num(series.values, nan=0.0, posinf=0.0, neginf=0.0)
    values = np.rint(finite * READ_AS.get(name, 1e6)).astype(np.int64)
    times = np.rint(1e3 * series.times).astype(np.int64)
    if name.startswith("command"):  # holds until it changes; the last sample ends it
        kept = np.append(True, np.any(np.diff(values, axis=0) != 0, axis=1))
        kept[-1] = True
        values, times = values[kept], times[kept]
    return {
        "scale": SCALES[name],
        "t": np.diff(times, prepend=0).tolist(),
        "v": [np.diff(column, prepend=0).tolist() for column in values.T],
    }
