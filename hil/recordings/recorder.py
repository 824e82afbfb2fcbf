"""What an experiment writes into while it runs: samples, bytes, and the lines that the program logs."""

from __future__ import annotations

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
from hil.recordings.errors import CannotBeWrittenError, unwritable, writing
from hil.recordings.mcap_file import RecordingFile
from hil.recordings.provenance import command_line, host, local_time, operator, source_commit, versions
from hil.recordings.recording import DELAYS, Event, Header, Recording, Series, Severity, delay_series
from hil.recordings.series_layout import CODES, LABELS, SERIES_UNITS
from hil.targets.target import Target
from hil.targets.wire_log import WireRecord

Progress = Callable[[float, str], None]
"""Called with the finished part (0..1) and what is being done."""

LOGGERS = ("aero", "hil")
"""Packages whose log lines are recorded."""
SHAPE = (len(Channel),)
"""Of a sample."""
_LOG = logging.getLogger(__name__)


def silent(_done: float, _doing: str) -> None:
    """Report progress to nobody."""


class Recorder:
    """Collects the samples of one experiment on one target, on disk as they come when it is given a file.

    Whoever runs an experiment makes the recorder and finishes it, also when the experiment was aborted; the
    experiment begins it. Times given to it are times of the target's clock; those in the recording count from the
    beginning.
    """

    def __init__(self, target: Target, experiment: str, path: Path | None = None) -> None:
        """Prepare to record `experiment`; `path` is the MCAP file to write, none when None."""
        self._target = target
        self._experiment = experiment
        self._path = path
        self._file: RecordingFile | None = None
        self._started = ""
        self._parameters: dict[str, float | str] = {}
        self._columns: dict[str, _Columns] = {}
        self._incomplete: set[str] = set()
        """Series of which a sample was left out."""
        self._events: list[Event] = []
        self._failure: CannotBeWrittenError | None = None
        self._wire_mark = 0
        self._attached: dict[str, Series] = {}
        self._log_lines = LogLines(self._add_event)
        self.start = 0.0
        """Time of the target's clock that is zero in the recording, s."""

    @property
    def begun(self) -> bool:
        """Whether there is anything to finish."""
        return bool(self._started)

    def begin(self, parameters: Mapping[str, float | str] | None = None, *, from_opening: bool = False) -> None:
        """Start now, or, for the bytes alone, at the opening of the target.

        Raises:
            CannotBeWrittenError: the file cannot be begun.
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
        """Add parameters that are known only after the beginning."""
        self._parameters |= parameters

    def add(self, name: str, t: float, row: NDArray[Any]) -> None:
        """Add a copy of one sample, (7,), taken at `t` (s on the target's clock), to a series of `SERIES_UNITS`.

        A sample with NaN or infinity is left out, which the first time is an event.

        Raises:
            ValueError: there is no such series, the row has another shape, or time runs backwards.
            CannotBeWrittenError: the file cannot be written.
        """
        if name not in SERIES_UNITS:
            raise ValueError(f"there is no series {name!r}; there are {', '.join(SERIES_UNITS)}")
        found = self._columns.get(name) or _Columns()
        at, sample = float(t - self.start), np.asarray(row, float)
        if sample.shape != SHAPE or not found.last <= at < inf:
            raise ValueError(
                f"a sample of {name} has shape (7,) and a time from {found.last:.3f} s on; got {sample.shape} at "
                f"{at:.3f} s"
            )
        # Seven numbers are looked at as numbers, at a quarter of what an array of them takes.
        numbers = sample.tolist()
        if not all(map(isfinite, numbers)):
            if name not in self._incomplete:
                self._incomplete.add(name)
                self.note(f"{name}: a sample without finite numbers is left out, {numbers}", "warning")
            return
        self._columns[name] = found
        found.add(at, numbers)
        if self._file is not None:
            self._write(RecordingFile.add_sample, name, LABELS, SERIES_UNITS[name], at, numbers)
            self._raise_failure()

    def has(self, name: str) -> bool:
        """Whether a series has a sample yet."""
        return name in self._columns

    def derive(self, name: str, source: str, convert: Callable[[NDArray[Any]], NDArray[Any]]) -> None:
        """Attach a series that is computed from all samples (n, 7) of another and has its times."""
        if self.has(source):
            found = self._columns[source]
            values = found.values().astype(np.uint16 if source in CODES else np.float64)
            self.attach(name, Series.of(LABELS, SERIES_UNITS[name], found.times, convert(values)))

    def attach(self, name: str, series: Series) -> None:
        """Add a whole series; it is written at the end."""
        self._attached[name] = series

    def note(self, text: str, severity: Severity = "info") -> None:
        """Add an event that happens now.

        Raises:
            CannotBeWrittenError: the file cannot be written.
        """
        self._add_event(text, severity)
        self._raise_failure()

    @property
    def failure(self) -> CannotBeWrittenError | None:
        """Why the file is not complete, None when it is or there is none."""
        return self._failure

    def finish(self, *, ended: bool = True) -> Recording:
        """Return the recording of everything since the beginning, complete and close the file.

        Nothing is recorded afterwards. A file that could not be written is closed as it is, see `failure`.

        Args:
            ended: whether the experiment ran to its end.
        """
        self._log_lines.end()
        wire = self._target.wire
        if self._add_wire in wire.listeners:
            wire.listeners.remove(self._add_wire)
        duration_s = self._target.clock.now() - self.start
        header = replace(self._header(), duration_s=duration_s, finished=ended)
        series = {
            name: Series.of(LABELS, SERIES_UNITS[name], found.times, found.values())
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
        """Add an event that happens now, silent when that fails: the guard's way out logs here."""
        event = Event(self._target.clock.now() - self.start, severity, text)
        self._events.append(event)
        self._write(RecordingFile.add_event, event)

    def _add_wire(self, record: WireRecord) -> None:
        """Write bytes that cross the link, silent when that fails: the guard's way out passes here."""
        self._write(RecordingFile.add_wire, record, self.start)

    def _write(self, action: Callable[..., None], *arguments: object) -> None:
        """Call a method of the file, if there is one that can be written to."""
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
            target=target.name,
            hand=target.side,
            firmware=target.firmware,
            map=target.map.coefficients.name,
            window=target.map.window.name,
            unit=target.unit,
            seed=target.seed,
            parameters=dict(self._parameters),
            safety={} if target.guard is None else target.guard.thresholds.as_dict(),
            versions=versions(),
            commit=source_commit(),
            started=self._started,
            finished=False,
            host=host(),
            command=command_line(),
            operator=operator(),
            hand_id=target.hand_id,
            serial_number=target.serial_number,
            faults=" ".join(map(str, target.wrong)),
        )


class _Columns:
    """The samples of a series while they are taken, as numbers one after another."""

    def __init__(self) -> None:
        self.times, self._numbers = array("d"), array("d")
        self.last = 0.0
        """Time of the last sample, s."""

    def add(self, t: float, numbers: list[float]) -> None:
        """Take one sample."""
        self.last = t
        self.times.append(t)
        self._numbers.extend(numbers)

    def values(self) -> NDArray[np.float64]:
        """Return all samples, (n, 7)."""
        return np.array(self._numbers).reshape(-1, *SHAPE)


class LogLines(logging.Handler):
    """Hands log lines of level INFO and above to a recording, those of the thread that makes it.

    Other threads only observe the hand, and a recording is for one thread.
    """

    def __init__(self, add: Callable[[str, Severity], None]) -> None:
        """Prepare; nothing comes before `begin`."""
        super().__init__(logging.INFO)
        self._add = add
        self._thread = threading.get_ident()
        self._levels: dict[str, int] = {}
        """What the loggers let through before, for `end`."""

    def begin(self) -> None:
        """Record lines from now on."""
        for logger in map(logging.getLogger, LOGGERS):
            self._levels[logger.name] = logger.level
            logger.setLevel(min(logging.INFO, logger.getEffectiveLevel()))
            logger.addHandler(self)

    def end(self) -> None:
        """Record no more lines; a second call does nothing."""
        while self._levels:
            name, level = self._levels.popitem()
            logger = logging.getLogger(name)
            logger.removeHandler(self)
            logger.setLevel(level)

    def emit(self, record: logging.LogRecord) -> None:
        """Hand one line over."""
        if record.thread != self._thread:
            return
        severity: Severity = "error" if record.levelno >= logging.ERROR else "warning"
        try:
            self._add(record.getMessage(), severity if record.levelno >= logging.WARNING else "info")
        except Exception:  # a line that cannot be recorded ends nothing
            self.handleError(record)
