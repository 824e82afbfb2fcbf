"""Recorder of a running experiment: samples, wire bytes and log lines."""

import logging
import threading
from array import array
from collections.abc import Callable, Mapping
from dataclasses import replace
from math import inf, isfinite
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from aero.safety.interrupts import uninterrupted
from hil.recordings.errors import CannotBeWrittenError, unwritable, writing
from hil.recordings.mcap_file import RecordingFile
from hil.recordings.provenance import local_time, origin
from hil.recordings.recording import DELAYS, Event, Header, Recording, Series, Severity, delay_series
from hil.recordings.series_layout import CODES, LABELS, SERIES_UNITS
from hil.targets.target import Target
from hil.targets.wire_log import WireRecord

Progress = Callable[[float, str], None]
"""Called with the finished fraction, 0 to 1, and the present activity."""

LOGGERS = ("aero", "hil")
"""Packages whose log lines are recorded."""
SHAPE = (len(Channel),)
_LOG = logging.getLogger(__name__)


def silent(_done: float, _doing: str) -> None:
    """Discard progress reports."""


class Recorder:
    """Collects the samples of one experiment on one target and, given a path, writes them to disk at once.

    The runner of an experiment creates the recorder and calls `finish` even after an abort; the experiment calls
    `begin`. Times of calls are on the target's clock; times in the recording count from `begin`.
    """

    def __init__(self, target: Target, experiment: str, path: Path | None = None) -> None:
        """Prepare to record `experiment`; `path` is the MCAP file to be written, or None for no file."""
        self._target = target
        self._experiment = experiment
        self._path = path
        self._file: RecordingFile | None = None
        self._started = ""
        self._parameters: dict[str, float | str] = {}
        self._columns: dict[str, _Columns] = {}
        self._incomplete: set[str] = set()
        """Series with a dropped sample."""
        self._events: list[Event] = []
        self._failure: CannotBeWrittenError | None = None
        self._finished: Recording | None = None
        self._wire_mark = 0
        self._attached: dict[str, Series] = {}
        self._log_lines = LogLines(self._add_event)
        self.start = 0.0
        """Zero of the recording's times, s on the target's clock."""

    @property
    def begun(self) -> bool:
        """True after `begin`."""
        return bool(self._started)

    def begin(self, parameters: Mapping[str, float | str] | None = None, *, from_opening: bool = False) -> None:
        """Start recording now or, for wire bytes only, at the opening of the target.

        Raises:
            CannotBeWrittenError: the file cannot be created.
        """
        wire = self._target.wire
        self._wire_mark = 0 if from_opening else wire.mark()
        self.start = wire.opened if from_opening else self._target.clock.now()
        self._parameters = dict(parameters or {})
        self._started = local_time(self._target.clock.now() - self.start)
        if self._path is not None:
            with writing(self._path):
                self._file = RecordingFile(self._path, self._header())
            for record in wire.since(self._wire_mark, self.start):
                self._write(RecordingFile.add_wire, record)
            wire.listeners.append(self._add_wire)
        self._log_lines.begin()

    def note_parameters(self, **parameters: float | str) -> None:
        """Add parameters that become known after `begin`."""
        self._parameters |= parameters

    def count(self, parameter: str) -> None:
        """Add one to a parameter, which begins with 0."""
        self._parameters[parameter] = float(self._parameters.get(parameter, 0.0)) + 1.0

    def add(self, name: str, t: float, row: NDArray[Any]) -> None:
        """Add a copy of one sample, (7,), taken at `t` (s on the target's clock), to a series of `SERIES_UNITS`.

        A sample with NaN or infinity is dropped, with an event for the first one of a series.

        Raises:
            ValueError: unknown series, wrong shape of the row, or decreasing time.
            CannotBeWrittenError: the file cannot be written.
        """
        if name not in SERIES_UNITS:
            raise ValueError(f"unknown series {name!r}; choose from {', '.join(SERIES_UNITS)}")
        found = self._columns.get(name) or _Columns()
        at, sample = float(t - self.start), np.asarray(row, float)
        if sample.shape != SHAPE or not found.last <= at < inf:
            raise ValueError(
                f"a sample of {name} has shape (7,) and a time from {found.last:.3f} s on; got {sample.shape} at "
                f"{at:.3f} s"
            )
        # Python floats instead of an array: `isfinite` of seven floats takes a quarter of the time.
        numbers = sample.tolist()
        if not all(map(isfinite, numbers)):
            if name not in self._incomplete:
                self._incomplete.add(name)
                self.note(f"{name}: a sample without finite numbers is left out, {numbers}", "warning")
            return
        self._columns[name] = found
        found.add((at, *numbers))
        if self._file is not None:
            self._write(RecordingFile.add_sample, name, LABELS, SERIES_UNITS[name], at, numbers)
            self._raise_failure()

    def has(self, name: str) -> bool:
        """Return True if a series has a sample."""
        return name in self._columns

    def derive(self, name: str, source: str, convert: Callable[[NDArray[Any]], NDArray[Any]]) -> None:
        """Attach a series computed from all samples, (n, 7), of a source series at the source's times."""
        if self.has(source):
            found = self._columns[source]
            values = found.values().astype(np.uint16 if source in CODES else np.float64)
            self.attach(name, Series.of(LABELS, SERIES_UNITS[name], found.times(), convert(values)))

    def attach(self, name: str, series: Series) -> None:
        """Add a whole series, to be written by `finish`."""
        self._attached[name] = series

    def note(self, text: str, severity: Severity = "info") -> None:
        """Add an event with the present time.

        Raises:
            CannotBeWrittenError: the file cannot be written.
        """
        self._add_event(text, severity)
        self._raise_failure()

    @property
    def failure(self) -> CannotBeWrittenError | None:
        """First write error, or None."""
        return self._failure

    def finish(self, *, ended: bool = True) -> Recording:
        """Stop recording, complete and close the file, and return the recording; a second call returns the same.

        Signals that stop the program are held meanwhile. After a write error (see `failure`) the file is closed
        incomplete.

        Args:
            ended: True if the experiment ran to its end.
        """
        with uninterrupted():
            if self._finished is None:
                self._finished = self._finish(ended=ended)
        return self._finished

    def _finish(self, *, ended: bool) -> Recording:
        self._log_lines.end()
        wire = self._target.wire
        if self._add_wire in wire.listeners:
            wire.listeners.remove(self._add_wire)
        duration_s = self._target.clock.now() - self.start
        header = replace(self._header(), duration_s=duration_s, finished=ended)
        series = {
            name: Series.of(LABELS, SERIES_UNITS[name], found.times(), found.values())
            for name, found in self._columns.items()
        }
        if (delays := delay_series(self._target.delays.since(self.start))) is not None:
            self.attach(DELAYS, delays)
        series |= self._attached
        if self._file is not None:
            for name, one in self._attached.items():
                self._write(RecordingFile.add_whole_series, name, one)
            self._write(RecordingFile.finish, header)
            self._file.close()
        return Recording(header, series, wire.since(self._wire_mark, self.start), tuple(self._events))

    def _add_event(self, text: str, severity: Severity) -> None:
        """Add an event with the present time; never raises, because a stop of the guard logs here."""
        event = Event(self._target.clock.now() - self.start, severity, text)
        self._events.append(event)
        self._write(RecordingFile.add_event, event)

    def _add_wire(self, record: WireRecord) -> None:
        """Write bytes that cross the link; never raises, because a stop of the guard sends bytes here."""
        self._write(RecordingFile.add_wire, record, self.start)

    def _write(self, action: Callable[..., None], *arguments: object) -> None:
        """Call a method of the file; skip without a file or after a write error."""
        if self._file is None or self._path is None or self._failure is not None:
            return
        try:
            action(self._file, *arguments)
        except OSError as error:
            self._failure = unwritable(self._path, error)
            _LOG.warning("the recording ends here: %s", self._failure)

    def _raise_failure(self) -> None:
        if self._failure is not None:
            raise self._failure

    def _header(self) -> Header:
        target = self._target
        return Header(
            experiment=self._experiment,
            target=target.port,
            side=target.side,
            firmware=target.firmware,
            map=target.map.coefficients.name,
            window=target.map.window.name,
            unit=target.unit,
            seed=target.seed,
            parameters=dict(self._parameters),
            safety={} if target.guard is None else target.guard.thresholds.as_dict(),
            finished=False,
            hand_id=target.hand_id,
            serial_number=target.serial_number,
            faults=" ".join(map(str, target.wrong)),
            **(origin() | {"started": self._started}),
        )


class _Columns:
    """Growing buffer of a series' samples."""

    def __init__(self) -> None:
        self._rows = array("d")
        self.last = 0.0

    def add(self, row: tuple[float, ...]) -> None:
        """Append the time and the numbers of one sample, at once: Ctrl-C may arrive at any line."""
        self._rows.extend(row)
        self.last = row[0]

    def _table(self) -> NDArray[np.float64]:
        return np.array(self._rows).reshape(-1, 1 + SHAPE[0])

    def times(self) -> NDArray[np.float64]:
        """Return the times of all samples, (n,), s."""
        return self._table()[:, 0]

    def values(self) -> NDArray[np.float64]:
        """Return all samples, (n, 7)."""
        return self._table()[:, 1:]


class LogLines(logging.Handler):
    """Log handler that adds lines of level INFO and above to a recording, from the creating thread only.

    Other threads only observe the hand, and a recording is not thread-safe.
    """

    def __init__(self, add: Callable[[str, Severity], None]) -> None:
        """Prepare the handler; `begin` attaches it to the loggers."""
        super().__init__(logging.INFO)
        self._add = add
        self._thread = threading.get_ident()
        self._levels: dict[str, int] = {}
        """Previous logger levels, restored by `end`."""

    def begin(self) -> None:
        """Start to record lines."""
        for logger in map(logging.getLogger, LOGGERS):
            self._levels[logger.name] = logger.level
            logger.setLevel(min(logging.INFO, logger.getEffectiveLevel()))
            logger.addHandler(self)

    def end(self) -> None:
        """Stop recording lines; a second call does nothing."""
        while self._levels:
            name, level = self._levels.popitem()
            logger = logging.getLogger(name)
            logger.removeHandler(self)
            logger.setLevel(level)

    def emit(self, record: logging.LogRecord) -> None:
        """Add one line to the recording."""
        if record.thread != self._thread:
            return
        severity: Severity = "error" if record.levelno >= logging.ERROR else "warning"
        try:
            self._add(record.getMessage(), severity if record.levelno >= logging.WARNING else "info")
        except Exception:  # a recording error must not end the caller of the logger
            self.handleError(record)
