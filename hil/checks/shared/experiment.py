"""What all experiments share: how they are described, how they drive a hand, how their results are named."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import wraps
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.actuation import ActuationMap
from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.shared.declaration import Metric
from hil.recordings.errors import CannotBeMeasuredError
from hil.recordings.recorder import Progress, Recorder, silent
from hil.recordings.recording import DELAYS, Header, Recording
from hil.targets.target import Target

Floats = NDArray[np.float64]
Measured = Mapping[str, Mapping[str, float]]
"""Subject (a channel's label, or `hand`) to metric to value: NaN where the hand did not let it be measured; a metric is
not there where this computer was too late to take it. `reading` asks for one."""


def reading(measured: Measured, subject: str, metric: str) -> float | None:
    """Return a reading, NaN where the hand did not let it be measured, None where it is not there."""
    value = measured.get(subject, {}).get(metric)
    return None if value is None else float(value)


def finite(measured: Measured, subject: str, metric: str) -> float | None:
    """Return a reading that is a number, None otherwise."""
    value = reading(measured, subject, metric)
    return value if value is not None and np.isfinite(value) else None


SAMPLE_S = 0.02
"""Time from one encoder reading to the next, s."""
CURRENT_EVERY = 5
TEMPERATURE_EVERY = 50
"""Samples of the encoders from one reading of the currents or temperatures to the next."""


@dataclass(frozen=True)
class Details:
    """A table about one recording that the page shows folded, for who wants to know more."""

    title: str
    text: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, kw_only=True)
class Measuring:
    """Something that is measured on a recording and judged."""

    name: str
    """Name on the command line, in files and in limits: that of its folder."""
    title: str
    """What it finds out, one line."""
    measure: Callable[..., Measured]
    """From a recording, or of `alike` from what was measured, by experiment."""
    metrics: tuple[Metric, ...]
    """Everything that `measure` returns."""
    seconds: str = ""
    """`all` when a finding takes the whole recording to see; the seconds in which its channel moves otherwise."""
    details: Callable[[Recording], Details] | None = None

    @property
    def columns(self) -> tuple[Metric, ...]:
        """One metric for each column of the table beside the paper, in their order; empty when it has no such table."""
        shown = {metric.column.place: metric for metric in self.metrics if metric.column}
        return tuple(shown[place] for place in sorted(shown))

    def metric(self, name: str, subject: str) -> Metric:
        """Return what is known of a number.

        Raises:
            KeyError: it is not measured on that subject.
        """
        for metric in self.metrics:
            if metric.name == name and subject in metric.subjects:
                return metric
        raise KeyError(f"{self.name} does not measure {name} on {subject}")


@dataclass(frozen=True, kw_only=True)
class Experiment(Measuring):
    """Something that moves a hand, and what its recording says."""

    run: Callable[[Target, Recorder, Progress], None]
    """Begins the recorder, moves the hand, and leaves everything in the recorder."""
    furthest: tuple[float, ...]
    """How far it sends each channel at most, part of the window, command order."""
    hand_s: float
    """How long it takes about, s of hand time."""
    rank: int
    """Place in the order in which a hand goes through the experiments: what asks least of it comes first."""
    period_s: float = SAMPLE_S
    """Planned time from one reading of the encoders to the next, s."""
    gate: bool = False
    """Whether a hand that fails it is kept from what follows."""
    gentle_after: tuple[str, ...] = ()
    """Metrics of a gate whose failure alone does not keep gentle experiments back, so that they tell more."""
    gentle: bool = False
    """Whether it moves little enough for a hand that pushes against something."""
    pushes_at_stops: bool = False
    """Whether it holds the thumb at a stop, which a guard permits at limited torque only."""
    by_default: bool = True
    """Whether it runs without being asked for by name."""
    asks: bool = False
    """Whether a person answers; no known fault is told from answers."""


def require(holds: bool, lacks: str) -> None:
    """See that a recording holds what is measured.

    Raises:
        CannotBeMeasuredError: it lacks that.
    """
    if not holds:
        raise CannotBeMeasuredError(f"the recording lacks {lacks}; was it cut short?")


def complete(measure: Callable[[Recording], Measured]) -> Callable[[Recording], Measured]:
    """Return a measurement that refuses a recording in which a series has less than two samples."""

    @wraps(measure)
    def measured(recording: Recording) -> Measured:
        for name, series in recording.series.items():
            require(name == DELAYS or len(series.times) > 1, f"samples of {name}")
        return measure(recording)

    return measured


def record(
    experiment: Experiment, target: Target, path: Path | None = None, *, progress: Progress = silent
) -> Recording:
    """Run one experiment and return its recording, written to the MCAP file `path` as it is made unless None."""
    recorder = Recorder(target, experiment.name, path)
    experiment.run(target, recorder, progress)
    return recorder.finish()


CATCHES_UP_S = 0.1
"""Lateness that the next hold may make up for, s; a shorter hold would not bring the hand where it is read."""


def sample(target: Target, recorder: Recorder, goal: NDArray[np.uint16], before: int) -> float:
    """Read the encoders, then command codes (7,), as a policy does; return when the command was sent, s.

    Currents and temperatures are read at times only: `before` is how many samples came before this one.
    """
    codes = target.hand.read_codes()
    recorder.add("codes", target.wire.sent_at, codes)
    target.hand.command_codes(goal)
    sent = target.wire.sent_at
    recorder.add("command_codes", sent, goal)
    if before % CURRENT_EVERY == 0:
        recorder.add("currents", target.clock.now(), target.hand.read_currents())
    if before % TEMPERATURE_EVERY == 0:
        recorder.add("temperatures", target.clock.now(), target.hand.read_temperatures())
    return sent


class Sampler:
    """Moves a target at the encoders' sample rate and records everything it reads."""

    def __init__(self, target: Target, recorder: Recorder, progress: Progress, seconds: float) -> None:
        """Start sampling, the recorder having begun; `seconds` is the planned hand time, for the progress."""
        self.recorder = recorder
        self._target = target
        self._progress = progress
        self._seconds = seconds
        self._samples = 0
        self._next = self.recorder.start

    def resume(self) -> None:
        """Go on sampling from now, after something else has used up time."""
        self._next = self._target.clock.now()

    def hold(self, codes: ArrayLike, seconds: float, doing: str) -> None:
        """Command codes (7,) at every sample for `seconds`, reading before each command as a policy does.

        A host that is late by whole samples leaves them out, so that what follows begins when it was planned. One that
        begins late by more than `CATCHES_UP_S` holds for the whole time, and what follows is later.
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
    """Return codes (7,) of an open hand with one channel closed by a part of its window."""
    codes = np.zeros(len(Channel), np.uint16)
    codes[channel] = round(fraction * MAX_CODE)
    return codes


def map_of(header: Header) -> ActuationMap:
    """Return the actuation map that a recording was made with."""
    return ActuationMap.for_firmware(header.firmware, header.window, hand=header.hand)


def last_before(times: Floats, values: Floats, t: float) -> Floats:
    """Return the last sample (k,) taken before `t`.

    Raises:
        CannotBeMeasuredError: there is none; the recording was cut short.
    """
    row = int(np.searchsorted(times, t)) - 1
    if row < 0:
        raise CannotBeMeasuredError(f"no sample before {t:.2f} s; was the recording cut short?")
    sample: Floats = values[row]
    return sample


LOOSE_GRASP = (0.5, 0.5, 0.5, 0.5, 0.5, 0.3, 0.4)
"""Parts of each channel's window: half closed, and no digit meets another."""
OPENED = np.zeros(len(Channel))
"""Codes (7,) of the open hand."""
