"""Recording of an experiment: header, time series with units, wire bytes, and events.

A recording is immutable, and the only input of every metric, plot and report. `hil.recordings.mcap_file` writes and
reads recordings.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Literal, Self

import numpy as np
from msgspec import Meta
from numpy.typing import ArrayLike, NDArray

from aero.side import Side
from hil.recordings.errors import CannotBeMeasuredError
from hil.targets.delays import Delay, Loop
from hil.targets.wire_log import WireRecord

Severity = Literal["info", "warning", "error"]
LARGEST = 1e15
"""Magnitude limit of any number in a header."""
Number = Annotated[float, Meta(ge=-LARGEST, le=LARGEST)]


@dataclass(frozen=True)
class Header:
    """Header of a recording: hand, experiment and provenance."""

    experiment: str
    """Name of the experiment, for example `staircase`."""
    target: str
    """Value of `--hil`: `emulated`, `pty`, a path or a pyserial URL."""
    side: Side
    """`right` or `left`."""
    firmware: str
    """Declared firmware version; selects map and limits."""
    map: str
    """Name of the actuation map's coefficients."""
    window: str
    """Name of the actuation map's command window (calibration state)."""
    unit: str
    """Unit file of an emulated hand; `physical` for a hand on a port."""
    seed: Annotated[int, Meta(ge=0)]
    """Seed of the emulated hand's noise; meaningless for a hand on a port."""
    parameters: Mapping[str, Number | int | str] = field(default_factory=dict)
    """Parameters of the experiment, units in the names."""
    safety: Mapping[str, Number] = field(default_factory=dict)
    """Thresholds of `aero.safety` by name; empty for an unguarded hand."""
    versions: Mapping[str, str] = field(default_factory=dict)
    """Versions of Python, aero-hil and its numerical libraries."""
    commit: str = ""
    """Git commit of aero-hil, `+changes` for an edited tree; empty if unknown."""
    started: str = ""
    """Start date and time, ISO 8601 with zone; empty in recordings of version 0.1."""
    duration_s: Annotated[float, Meta(ge=0.0, le=LARGEST)] = 0.0
    """Duration in hand time, s; zero in an unfinished recording."""
    finished: bool = True
    """True if the experiment ran to its end and the file is complete."""
    host: str = ""
    command: str = ""
    operator: str = ""
    """Name of the operator; empty if unknown."""
    hand_id: str = ""
    """Name or serial number of the individual hand."""
    serial_number: str = ""
    """Serial number of the hand's USB port; empty if unknown."""
    faults: str = ""
    """Faults of an emulated hand as `hil.emulated.faults.parse_fault` reads them, separated by blanks."""

    def number(self, parameter: str) -> float:
        """Return a numeric parameter of the experiment.

        Raises:
            CannotBeMeasuredError: the parameter is missing or not a number.
        """
        value = self.parameters.get(parameter)
        if not isinstance(value, int | float):
            raise CannotBeMeasuredError(f"its header gives no number {parameter!r}")
        return float(value)


@dataclass(frozen=True)
class Series:
    """Time series of one or more quantities, in read-only arrays.

    Raises:
        ValueError: shapes disagree, a value is not finite, or times decrease.
    """

    columns: tuple[str, ...]
    """Column names in file and plot, usually the seven channel labels."""
    units: tuple[str, ...]
    times: NDArray[np.float64]
    """(n,) float, s since the start of the recording, never decreasing."""
    values: NDArray[np.float64]
    """(n, k) float, one row a sample."""

    @classmethod
    def of(cls, columns: Iterable[str], units: Iterable[str], times: ArrayLike, values: ArrayLike) -> Self:
        """Build a series from anything array-like."""
        return cls(tuple(columns), tuple(units), np.asarray(times, float), np.asarray(values, float))

    def __post_init__(self) -> None:
        k = len(self.columns)
        if len(self.units) != k or self.times.ndim != 1 or self.values.shape != (len(self.times), k):
            raise ValueError(
                f"a series of {k} columns needs {k} units, times (n,) and values (n, {k}); got {len(self.units)} "
                f"units, times {self.times.shape} and values {self.values.shape}"
            )
        if not (np.isfinite(self.times).all() and np.isfinite(self.values).all()):
            raise ValueError("a series has finite numbers only; omit samples without a reading")
        if np.any(np.diff(self.times, prepend=0.0) < 0):
            raise ValueError("the times of a series start at zero or later and never decrease")
        for name in ("times", "values"):
            array = getattr(self, name)
            if array.flags.writeable or array.base is not None:
                array = array.copy()
                array.flags.writeable = False
                object.__setattr__(self, name, array)

    def __eq__(self, other: object) -> bool:
        """Compare names, units and every sample exactly."""
        if not isinstance(other, Series):
            return NotImplemented
        return (
            (self.columns, self.units) == (other.columns, other.units)
            and np.array_equal(self.times, other.times)
            and np.array_equal(self.values, other.values)
        )

    __hash__ = None  # type: ignore[assignment]  # arrays have no hash

    def column(self, name: str) -> NDArray[np.float64]:
        """Return one column, (n,) float.

        Raises:
            CannotBeMeasuredError: no such column; the message names the existing ones.
        """
        if name not in self.columns:
            raise CannotBeMeasuredError(f"no column {name!r}; there are {', '.join(self.columns)}")
        return self.values[:, self.columns.index(name)]


@dataclass(frozen=True)
class Event:
    """Log line of a recording: start of a phase, warning, abort."""

    t: float
    """Time since the start of the recording, s."""
    severity: Severity
    text: str


@dataclass(frozen=True)
class Recording:
    """Recording of one run of one experiment."""

    header: Header
    series: Mapping[str, Series]
    """Series by name; each experiment's docstring lists its own."""
    wire: tuple[WireRecord, ...] = ()
    events: tuple[Event, ...] = ()

    def __getitem__(self, name: str) -> Series:
        """Return one series.

        Raises:
            CannotBeMeasuredError: no such series; the message names the existing ones.
        """
        if name not in self.series:
            known = ", ".join(self.series) or "none"
            raise CannotBeMeasuredError(
                f"this recording of {self.header.experiment!r} has no series {name!r}; it has {known}"
            )
        return self.series[name]

    @cached_property
    def delays(self) -> tuple[Delay, ...]:
        """Scheduling delays of this program and an emulated board, times since the recording's start, s.

        Empty on virtual time.
        """
        if DELAYS not in self.series:
            return ()
        series = self.series[DELAYS]
        by_loop = [(loop, series.column(loop.value)) for loop in Loop]
        return tuple(
            Delay(float(t), float(by_s[i]), loop)
            for i, t in enumerate(series.times)
            for loop, by_s in by_loop
            if by_s[i] > 0.0
        )


DELAYS = "delays"
"""Name of the series of delays: one column a loop, s, at the time of resumption."""


def delay_series(delays: Sequence[Delay]) -> Series | None:
    """Return delays as a series of a recording, or None without delays."""
    if not delays:
        return None
    values = [[delay.by_s if delay.loop is loop else 0.0 for loop in Loop] for delay in delays]
    return Series.of([loop.value for loop in Loop], ["s"] * len(Loop), [delay.t for delay in delays], values)
