"""What all experiments share: how they are described, how they drive a hand, how their results are named."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.actuation import ActuationMap
from aero.channels import Channel
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Header, Recording
from hil.targets.target import Target

Floats = NDArray[np.float64]
Measured = Mapping[str, Mapping[str, float]]
"""Subject (a channel's label, or `hand`) to metric to value."""

SAMPLE_S = 0.02
"""Time from one encoder reading to the next, s."""
FULL = 65535
"""Code of a closed channel."""
CURRENT_EVERY = 5
TEMPERATURE_EVERY = 50
"""Samples of the encoders from one reading of the currents or temperatures to the next."""


@dataclass(frozen=True)
class Experiment:
    """One experiment: how to run it, and what its recording says."""

    name: str
    """Name on the command line, in files and in limits."""
    title: str
    """What it finds out, one line."""
    run: Callable[[Target, Progress], Recording]
    measure: Callable[[Recording], Measured]
    furthest: tuple[float, ...]
    """How far it sends each channel at most, part of the window, command order."""


class Driver:
    """Moves a target at the encoders' sample rate and records everything it reads."""

    def __init__(self, target: Target, progress: Progress, seconds: float) -> None:
        """Start recording; `seconds` is the planned hand time, for the progress."""
        self.recorder = Recorder(target)
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
            recorder.add("codes", clock.now(), target.hand.read_codes())
            recorder.add("command_codes", clock.now(), goal)
            target.hand.command_codes(goal)
            if self._samples % CURRENT_EVERY == 0:
                recorder.add("currents", clock.now(), target.hand.read_currents())
            if self._samples % TEMPERATURE_EVERY == 0:
                recorder.add("temperatures", clock.now(), target.hand.read_temperatures())
            self._samples += 1
            self._progress(min(1.0, self._samples * SAMPLE_S / self._seconds), doing)


def one_closed(channel: Channel, fraction: float) -> NDArray[np.uint16]:
    """Return codes (7,) of an open hand with one channel closed by a part of its window."""
    codes = np.zeros(len(Channel), np.uint16)
    codes[channel] = round(fraction * FULL)
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
