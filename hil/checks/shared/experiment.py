"""What all experiments share: how they are described, how they drive a hand, how their results are named."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.actuation import ActuationMap
from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.recordings.recorder import Progress, Recorder, silent
from hil.recordings.recording import Header, Recording
from hil.targets.target import Target

Floats = NDArray[np.float64]
Measured = Mapping[str, Mapping[str, float]]
"""Subject (a channel's label, or `hand`) to metric to value."""

SAMPLE_S = 0.02
"""Time from one encoder reading to the next, s."""
CURRENT_EVERY = 5
TEMPERATURE_EVERY = 50
"""Samples of the encoders from one reading of the currents or temperatures to the next."""


@dataclass(frozen=True)
class Metric:
    """One number that an experiment measures; `hil.verdict.limits` says how large it may be."""

    name: str
    """Name in `checks.json` and in the limits."""
    unit: str
    """As people read it; `length` stands for mm, and mrad for the abduction."""
    subjects: tuple[str, ...]
    """What it is measured on: labels of channels, or `hand`."""
    meaning: str
    """What it usually means when it is off; what the number is, when it has no limit."""
    remedy: str = ""
    """What to do then; empty when it has no limit."""
    end_of_scale: float = math.inf
    """Reading at which the board clamps: what is really there may be anything beyond."""


class Measuring(Protocol):
    """What is measured on a recording and judged."""

    @property
    def name(self) -> str:
        """Name in files and in limits."""
        ...

    @property
    def metrics(self) -> tuple[Metric, ...]:
        """Everything that it measures."""
        ...


@dataclass(frozen=True)
class Experiment:
    """One experiment: how to run it, what its recording says, and what that means."""

    name: str
    """Name on the command line, in files and in limits."""
    title: str
    """What it finds out, one line."""
    run: Callable[[Target, Recorder, Progress], None]
    """Begins the recorder, moves the hand, and leaves everything in the recorder."""
    measure: Callable[[Recording], Measured]
    furthest: tuple[float, ...]
    """How far it sends each channel at most, part of the window, command order."""
    metrics: tuple[Metric, ...]
    """Everything that `measure` returns."""
    rank: int
    """Place in the order in which a hand goes through the experiments: what asks least of it comes first."""
    gate: bool = False
    """Whether a hand that fails it is kept from what follows."""
    gentle_after: frozenset[str] = frozenset()
    """Metrics of a gate whose failure alone does not keep gentle experiments back, so that they tell more."""
    gentle: bool = False
    """Whether it moves little enough for a hand that pushes against something."""
    pushes_at_stops: bool = False
    """Whether it holds the thumb at a stop, which a guard permits at limited torque only."""
    by_default: bool = True
    """Whether it runs without being asked for by name."""


def metric_of(measuring: Measuring, name: str, subject: str) -> Metric:
    """Return what is known of a number.

    Raises:
        KeyError: it is not measured on that subject.
    """
    for metric in measuring.metrics:
        if metric.name == name and subject in metric.subjects:
            return metric
    raise KeyError(f"{measuring.name} does not measure {name} on {subject}")


def record(
    experiment: Experiment, target: Target, path: Path | None = None, *, progress: Progress = silent
) -> Recording:
    """Run one experiment and return its recording, written to the MCAP file `path` as it is made unless None."""
    recorder = Recorder(target, experiment.name, path)
    experiment.run(target, recorder, progress)
    return recorder.finish()


class Driver:
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
        """Command codes (7,) at every sample for `seconds`, reading before each command as a policy does."""
        target, recorder = self._target, self.recorder
        goal = np.asarray(codes, np.uint16)
        for _ in range(round(seconds / SAMPLE_S)):
            clock = target.clock
            clock.sleep_until(self._next)
            self._next += SAMPLE_S
            codes_read = target.hand.read_codes()
            recorder.add("codes", target.wire.sent_at, codes_read)
            target.hand.command_codes(goal)
            recorder.add("command_codes", target.wire.sent_at, goal)
            if self._samples % CURRENT_EVERY == 0:
                recorder.add("currents", clock.now(), target.hand.read_currents())
            if self._samples % TEMPERATURE_EVERY == 0:
                recorder.add("temperatures", clock.now(), target.hand.read_temperatures())
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
        ValueError: there is none; the recording was cut short.
    """
    row = int(np.searchsorted(times, t)) - 1
    if row < 0:
        raise ValueError(f"no sample before {t:.2f} s; was the recording cut short?")
    sample: Floats = values[row]
    return sample
