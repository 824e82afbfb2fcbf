"""Common parts of the experiments: description, sampling, names of results."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import wraps
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.actuation import ActuationMap
from aero.channels import Channel
from aero.floats import Floats
from aero.protocol import MAX_CODE
from hil.checks.shared.declaration import Metric
from hil.checks.shared.signals import MILLI
from hil.recordings.errors import CannotBeMeasuredError
from hil.recordings.recorder import Progress, Recorder, silent
from hil.recordings.recording import DELAYS, Header, Recording
from hil.targets.target import Target

Measured = Mapping[str, Mapping[str, float]]
"""Values by subject (a channel's label, or `hand`) and metric; read with `reading`.

NaN marks an unmeasurable value; a missing metric was too late on this computer.
"""


def reading(measured: Measured, subject: str, metric: str) -> float | None:
    """Return a reading; NaN if unmeasurable, None if missing."""
    value = measured.get(subject, {}).get(metric)
    return None if value is None else float(value)


def finite(measured: Measured, subject: str, metric: str) -> float | None:
    """Return a finite reading, or None."""
    value = reading(measured, subject, metric)
    return value if value is not None and np.isfinite(value) else None


SAMPLE_S = 0.02
"""Period of the encoder readings, s."""
CURRENT_EVERY = 5
TEMPERATURE_EVERY = 50
"""Number of encoder samples per reading of the currents or temperatures."""


@dataclass(frozen=True)
class Details:
    """Folded table of the page with details of one recording."""

    title: str
    text: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


Step = Callable[[str, tuple[str, ...]], float]
"""Smallest step between two readings by firmware version and subjects; 0 for interpolated readings."""


@dataclass(frozen=True, kw_only=True)
class Measuring:
    """Measurement on a recording, with judged metrics."""

    name: str
    """Name on the command line, in files and in limits; equals the folder's name."""
    title: str
    """Purpose in one line."""
    measure: Callable[..., Measured]
    """Function of a recording; for `alike`, of the readings by experiment."""
    metrics: tuple[Metric, ...]
    """All values that `measure` returns."""
    seconds: str = ""
    """Stretch affected by scheduling delays: `all` for the whole recording, otherwise the channel's own motion."""
    details: Callable[[Recording], Details] | None = None
    resolution: Mapping[str, Step] = field(default_factory=dict)
    """Smallest step between two readings of a metric, in its unit, where the unit does not determine it."""
    of_any_version: bool = False
    """Whether no reading differs between firmware versions except by findings of its own, such as boot text."""

    @property
    def columns(self) -> tuple[Metric, ...]:
        """Metrics of the table beside the paper, in column order; empty without such a table."""
        shown = {metric.column.place: metric for metric in self.metrics if metric.column}
        return tuple(shown[place] for place in sorted(shown))

    def metric(self, name: str, subject: str) -> Metric:
        """Return the metric with this name on a subject.

        Raises:
            KeyError: it is not measured on that subject.
        """
        for metric in self.metrics:
            if metric.name == name and subject in metric.subjects:
                return metric
        raise KeyError(f"{self.name} does not measure {name} on {subject}")


@dataclass(frozen=True, kw_only=True)
class Experiment(Measuring):
    """Motion of a hand, and the measurement of its recording."""

    run: Callable[[Target, Recorder, Progress], None]
    """Function that starts the recorder, moves the hand, and records all series."""
    furthest: tuple[float, ...]
    """Largest commanded fraction of each channel's window, command order."""
    hand_s: float
    """Approximate duration, s of hand time."""
    rank: int
    """Position in the run order; the least demanding experiment is first."""
    period_s: float = SAMPLE_S
    """Planned period of the encoder readings, s."""
    gate: bool = False
    """Whether a hand that fails this experiment is excluded from the following ones."""
    gentle_after: tuple[str, ...] = ()
    """Metrics of a gate whose failure alone still permits gentle experiments, for more evidence."""
    gentle: bool = False
    """Whether the motion is small enough for a hand in contact with an obstacle."""
    pushes_at_stops: bool = False
    """Whether the experiment holds the thumb at a stop, which a guard permits only at limited torque."""
    by_default: bool = True
    asks: bool = False
    """Whether a person answers; answers do not identify faults."""


def require(holds: bool, lacks: str) -> None:
    """Raise unless a recording contains the required data.

    Raises:
        CannotBeMeasuredError: the data are missing.
    """
    if not holds:
        raise CannotBeMeasuredError(f"the recording lacks {lacks}; was it cut short?")


def complete(measure: Callable[[Recording], Measured]) -> Callable[[Recording], Measured]:
    """Return a measurement that rejects a recording with fewer than two samples in a series."""

    @wraps(measure)
    def measured(recording: Recording) -> Measured:
        for name, series in recording.series.items():
            require(name == DELAYS or len(series.times) > 1, f"samples of {name}")
        return measure(recording)

    return measured


def record(
    experiment: Experiment, target: Target, path: Path | None = None, *, progress: Progress = silent
) -> Recording:
    """Run one experiment and return its recording, written to the MCAP file `path` meanwhile if given."""
    recorder = Recorder(target, experiment.name, path)
    experiment.run(target, recorder, progress)
    return recorder.finish()


CATCHES_UP_S = 0.1
"""Largest lateness that the next hold may catch up, s; a shorter hold would end before the hand arrives."""


UNASKED = "unasked_readings"
"""Parameter of a recording: readings that the driver returned without a byte to the board."""


UNCLIPPED = "unclipped_targets"
"""Parameter of a recording: ends of windows beyond which the map returns another code than the end's."""
BEYOND_RAD = (1e-4, 0.5, 100.0)


def unclipped(codec: ActuationMap) -> int:
    """Return the number of window ends beyond which a target is not clipped; a code that wraps is a full motion."""
    low, high = codec.window_rad.T
    wrong = np.zeros((2, len(Channel)), bool)
    for beyond in BEYOND_RAD:
        wrong[0] |= np.asarray(codec.saturating_codes(low - beyond).codes) != 0
        wrong[1] |= np.asarray(codec.saturating_codes(high + beyond).codes) != MAX_CODE
    return int(wrong.sum())


def read(target: Target, recorder: Recorder, call: Callable[[], NDArray[Any]]) -> tuple[NDArray[Any], float]:
    """Return a reading of the driver, (7,), and the time of its request, s.

    A reading without a request has the time of the call, and is counted in the parameter `UNASKED`.
    """
    called, mark = target.clock.now(), target.wire.mark()
    values = call()
    if target.wire.mark() == mark:
        recorder.count(UNASKED)
    return values, max(called, target.wire.sent_at)


def sample(target: Target, recorder: Recorder, goal: NDArray[np.uint16], before: int) -> float:
    """Read the encoders, then command codes (7,), as a policy does; return the send time of the command, s.

    Currents and temperatures are read less often: `before` is the number of earlier samples.
    """
    codes, asked = read(target, recorder, target.hand.read_codes)
    recorder.add("codes", asked, codes)
    commanded = target.clock.now()
    target.hand.command_codes(goal)
    sent = max(commanded, target.wire.sent_at)  # a driver may send later
    recorder.add("command_codes", sent, goal)
    if before % CURRENT_EVERY == 0:
        recorder.add("currents", target.clock.now(), target.hand.read_currents())
    if before % TEMPERATURE_EVERY == 0:
        recorder.add("temperatures", target.clock.now(), target.hand.read_temperatures())
    return sent


class Sampler:
    """Motion of a target at the encoders' sample rate, with all readings recorded."""

    def __init__(self, target: Target, recorder: Recorder, progress: Progress, seconds: float) -> None:
        """Start sampling with a started recorder; `seconds` is the planned hand time, for the progress."""
        self.recorder = recorder
        self._target = target
        self._progress = progress
        self._seconds = seconds
        self._samples = 0
        self._next = self.recorder.start

    def resume(self) -> None:
        """Restart the sample clock after other work took time."""
        self._next = self._target.clock.now()

    def hold(self, codes: ArrayLike, seconds: float, doing: str) -> None:
        """Command codes (7,) at every sample for `seconds`, reading before each command as a policy does.

        A host that is late by whole samples skips them, so that the next hold starts on time. If a hold starts late by
        more than `CATCHES_UP_S`, it keeps its full duration and delays the next.
        """
        target, clock = self._target, self._target.clock
        if clock.now() - self._next > CATCHES_UP_S:
            self.resume()
        goal = np.asarray(codes, np.uint16)
        left = round(seconds / SAMPLE_S)
        while left > 0:
            clock.sleep_until(self._next)
            missed = min(left - 1, int((clock.now() - self._next) / SAMPLE_S))
            left -= 1 + missed
            self._next += (1 + missed) * SAMPLE_S
            sample(target, self.recorder, goal, self._samples)
            self._samples += 1
            self._progress(min(1.0, self._samples * SAMPLE_S / self._seconds), doing)


def one_closed(channel: Channel, fraction: float) -> NDArray[np.uint16]:
    """Return codes (7,) of an open hand with one channel closed by a fraction of its window."""
    codes = np.zeros(len(Channel), np.uint16)
    codes[channel] = round(fraction * MAX_CODE)
    return codes


def map_of(header: Header) -> ActuationMap:
    """Return the actuation map of a recording."""
    return ActuationMap.for_firmware(header.firmware, header.window, side=header.side)


def window_mm(codec: ActuationMap) -> Floats:
    """Return the travel of each channel over its window, (7,), mm or mrad."""
    ends = codec.travel_from_angles(codec.angles_from_codes(np.outer([0, MAX_CODE], np.ones(len(Channel), int))))
    travel: Floats = MILLI * np.abs(np.diff(ends, axis=0))[0]
    return travel


def last_before(times: Floats, values: Floats, t: float) -> Floats:
    """Return the last sample (k,) taken before `t`.

    Raises:
        CannotBeMeasuredError: no such sample, as in a truncated recording.
    """
    row = int(np.searchsorted(times, t)) - 1
    if row < 0:
        raise CannotBeMeasuredError(f"no sample before {t:.2f} s; was the recording cut short?")
    sample: Floats = values[row]
    return sample


LOOSE_GRASP = (0.5, 0.5, 0.5, 0.5, 0.5, 0.3, 0.4)
"""Fraction of each channel's window: half closed, without contact between digits."""
OPENED = np.zeros(len(Channel))
"""Codes (7,) of the open hand."""
