"""Interactive plots of a report: embedded readings, and the initial view of each plot."""

import base64
import json
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import NamedTuple

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
"""Plotted series, to the resolution of their integers on the page: % of window, A, °C, mm and mrad."""
READ_AS = {"codes": 1.0, "command_codes": 1.0, "currents": 1e3, "temperatures": 10.0}
"""Integer steps per unit of a series; by default 1e6, steps of a thousandth of a mm or mrad."""
ROWS = ("position", "error", "current", "temperature", "length", "difference")
"""Plot rows of `templates/plots.js`, top to bottom; rows without recorded data are omitted."""


class Band(NamedTuple):
    """Permitted range of a channel in a row, in the row's unit; None for an open end."""

    row: str
    channel: int
    low: float | None
    high: float | None
    words: str
    """Name of the reading, which may be that at the end stop only."""


@dataclass(frozen=True)
class PlotColumn:
    """Column of a plot: channels and a time range."""

    channels: tuple[int, ...]
    start: float
    end: float
    title: str = ""
    mark: tuple[float, float] | None = None
    """Shaded time range, s."""
    at: float | None = None
    """Time of a marker line, s."""
    zero: float = 0.0
    """Zero of this column's time in a plot with a common time axis, s."""


@dataclass(frozen=True)
class Plot:
    """Figure of the page: a grid of rows and columns, with one time axis a column."""

    name: str
    """Unique name on the page, the target of links."""
    experiment: str
    rows: tuple[str, ...]
    columns: tuple[PlotColumn, ...]
    together: bool = False
    """True to overlay all columns on one time axis, each from its own `zero`."""
    bands: tuple[Band, ...] = ()
    """Limit bands; a chart draws the one that its channels share."""

    @property
    def json(self) -> str:
        """JSON of the figure for `templates/plots.js`."""
        return json.dumps(asdict(self))


def has_samples(recording: Recording, series: str) -> bool:
    """Return True if a recording has a series with samples; a truncated recording may have none."""
    return series in recording.series and recording[series].times.size > 0


def drawable(recording: Recording) -> bool:
    """Return True if a recording has any series to plot."""
    return any(has_samples(recording, name) for name in SCALES)


def with_samples(recording: Recording) -> Recording:
    """Return a recording with series to plot, decoded from its wire bytes if no series was recorded."""
    return recording if drawable(recording) else with_series(recording)


def duration_s(recording: Recording) -> float:
    """Return the time of the last sample, s; 0 without samples."""
    return max((float(series.times[-1]) for series in recording.series.values() if series.times.size), default=0.0)


def whole(recording: Recording, channels: Iterable[Channel]) -> Plot:
    """Return the plot of a whole recording with selectable channels, `channels` at first."""
    name = recording.header.experiment
    return Plot(f"plot-{name}", name, ROWS, (PlotColumn(tuple(channels), 0.0, duration_s(recording)),))


def packed(recordings: Mapping[str, Recording]) -> str:
    """Return the readings of all recordings as embedded in the page: delta-coded integers, JSON, zlib, base64.

    Every sample is included; a validation takes about 75 kB.
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
    if name.startswith("command"):  # piecewise constant: store changes and the last sample
        kept = np.append(True, np.any(np.diff(values, axis=0) != 0, axis=1))
        kept[-1] = True
        values, times = values[kept], times[kept]
    return {
        "scale": SCALES[name],
        "t": np.diff(times, prepend=0).tolist(),
        "v": [np.diff(column, prepend=0).tolist() for column in values.T],
    }
