"""What an experiment leaves behind: a header, time series with units, the bytes on the wire, and events.

A recording is immutable and complete: every metric, plot and report of this project is computed from one and from
nothing else. `hil.recordings.mcap_file` writes it to disk and reads it back.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from functools import cached_property
from typing import Any, Literal, Self, get_args, get_type_hints

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hil.recordings.errors import CannotBeMeasuredError
from hil.targets.delays import Delay, Loop
from hil.targets.wire_log import WireRecord
from model.geometry import Side

Severity = Literal["info", "warning", "error"]


@dataclass(frozen=True)
class Header:
    """Which hand was measured, with what, and by which state of this project."""

    experiment: str
    """Name of the experiment, for example `staircase`."""
    target: str
    """What `--hil` was: `emulated`, `pty`, a path or a pyserial URL."""
    hand: Side
    """`right` or `left`."""
    firmware: str
    """Firmware version the map and the limits were chosen for."""
    map: str
    """Coefficients of the actuation map in use."""
    window: str
    """Calibration state of the command window that the map is for."""
    unit: str
    """Unit file of an emulated hand; `physical` for a hand on a port."""
    seed: int
    """Seed of the emulated hand's noise; without meaning on a port."""
    parameters: Mapping[str, float | str] = field(default_factory=dict)
    """Parameters of the experiment, units in the names."""
    safety: Mapping[str, float] = field(default_factory=dict)
    """Thresholds of `aero.safety` by name; empty when the hand was not guarded."""
    versions: Mapping[str, str] = field(default_factory=dict)
    """Versions of Python, of this project and of what it computes with."""
    commit: str = ""
    """Git commit of this project's source, `+changes` when the tree was not clean; empty when it is not known."""
    started: str = ""
    """Date and time of the beginning, ISO 8601 with zone; empty in recordings of version 0.1."""
    duration_s: float = 0.0
    """Hand time from the beginning to the end, s; zero when it was not finished."""
    finished: bool = True
    """Whether the experiment ran to its end and the file was completed."""
    host: str = ""
    """Name of the computer."""
    command: str = ""
    """Command line of the program that recorded."""
    operator: str = ""
    """Who ran it, when that was said."""
    hand_id: str = ""
    """Name or serial number of the individual hand."""
    serial_number: str = ""
    """Of the USB port of the hand; empty where it has none."""
    faults: str = ""
    """What was made wrong with an emulated hand, as `hil.faults.parse_fault` reads it, with blanks between."""

    def number(self, parameter: str) -> float:
        """Return a parameter of the experiment that is a number.

        Raises:
            CannotBeMeasuredError: there is none, or it is no number.
        """
        value = self.parameters.get(parameter)
        if not isinstance(value, int | float):
            raise CannotBeMeasuredError(f"its header gives no number {parameter!r}")
        return float(value)


@dataclass(frozen=True)
class Series:
    """One or more quantities sampled together, in arrays of its own that nothing writes to.

    Raises:
        ValueError: shapes do not agree, a value is not finite, or times run backwards.
    """

    columns: tuple[str, ...]
    """Names, in file and plot; the seven channel labels for most series."""
    units: tuple[str, ...]
    """One unit a column."""
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
            raise ValueError("a series holds finite numbers only; leave a sample out where there is none")
        if np.any(np.diff(self.times, prepend=0.0) < 0):
            raise ValueError("the times of a series start at zero or later and never decrease")
        for name in ("times", "values"):
            array = getattr(self, name)
            if array.flags.writeable or array.base is not None:
                array = array.copy()
                array.flags.writeable = False
                object.__setattr__(self, name, array)

    def __eq__(self, other: object) -> bool:
        """Compare names, units and every sample to the bit."""
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
            CannotBeMeasuredError: there is no such column; the message lists those there are.
        """
        if name not in self.columns:
            raise CannotBeMeasuredError(f"no column {name!r}; there are {', '.join(self.columns)}")
        return self.values[:, self.columns.index(name)]


@dataclass(frozen=True)
class Event:
    """Something worth a line: a phase that began, a warning, an abort."""

    t: float
    """s since the start of the recording."""
    severity: Severity
    text: str


@dataclass(frozen=True)
class Recording:
    """One run of one experiment."""

    header: Header
    series: Mapping[str, Series]
    """By name; an experiment's docstring says which it leaves."""
    wire: tuple[WireRecord, ...] = ()
    events: tuple[Event, ...] = ()

    def __getitem__(self, name: str) -> Series:
        """Return one series.

        Raises:
            CannotBeMeasuredError: there is no such series; the message lists those there are.
        """
        if name not in self.series:
            known = ", ".join(self.series) or "none"
            raise CannotBeMeasuredError(
                f"this recording of {self.header.experiment!r} has no series {name!r}; it has {known}"
            )
        return self.series[name]

    @cached_property
    def delays(self) -> tuple[Delay, ...]:
        """How long this program's loop or an emulated board's was held up; empty where time was virtual.

        Times are s since the start of the recording.
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

    def longest_delay(self, start: float, end: float) -> Delay | None:
        """Return the longest delay within a window (s since the start of the recording), None without any."""
        within = [delay for delay in self.delays if delay.t >= start and delay.t - delay.by_s <= end]
        return max(within, key=lambda delay: delay.by_s, default=None)


DELAYS = "delays"
"""Series of delays: a column for each loop, s, at the time at which the loop resumed."""


def delay_series(delays: Sequence[Delay]) -> Series | None:
    """Return delays as the series of a recording, None where there are none."""
    if not delays:
        return None
    values = [[delay.by_s if delay.loop is loop else 0.0 for loop in Loop] for delay in delays]
    return Series.of([loop.value for loop in Loop], ["s"] * len(Loop), [delay.t for delay in delays], values)


def _text(value: Any) -> bool:
    return isinstance(value, str)


def _whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST


def _table(of: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, Mapping) and all(map(_text, value)) and all(map(of, value.values()))


def _date(value: Any) -> bool:
    if not _text(value):
        return False
    try:
        return not value or abs(datetime.fromisoformat(value).timestamp()) < FARTHEST_S
    except (ValueError, OverflowError, OSError):
        return False


LARGEST = 1e15
"""Of any number in a header."""
FARTHEST_S = 2**33
"""From 1970, s: the times of MCAP, ns in 64 bits, reach the year 2554."""
KINDS: dict[Any, tuple[Callable[[Any], bool], str]] = {
    str: (_text, "a text"),
    int: (_whole, "a whole number from 0 on"),
    float: (lambda value: _number(value) and value >= 0.0, "seconds from 0 on"),
    bool: (lambda value: isinstance(value, bool), "true or false"),
    Side: (lambda value: value in get_args(Side), "right or left"),
    Mapping[str, float | str]: (
        _table(lambda value: _text(value) or _number(value)),
        "texts and finite numbers by name",
    ),
    Mapping[str, float]: (_table(_number), "finite numbers by name"),
    Mapping[str, str]: (_table(_text), "texts by name"),
}
"""Type of a field of `Header`, what it accepts, and what that is."""
FIELD_KINDS = {name: KINDS[kind] for name, kind in get_type_hints(Header).items()} | {
    "started": (_date, "a date, ISO 8601")
}


def check_header(header: Mapping[str, Any]) -> None:
    """See that every value of a header has the kind of its field.

    Raises:
        ValueError: one has not, or there is no such field; the message names it.
    """
    for name, value in header.items():
        if name not in FIELD_KINDS:
            raise ValueError(f"the header has a field {name!r}, which this version does not know")
        accepts, what = FIELD_KINDS[name]
        if not accepts(value) or (isinstance(value, float) and math.isnan(value)):
            raise ValueError(f"{name} in the header is {str(value)[:80]!r}, not {what}")
