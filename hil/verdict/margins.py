"""How far the guard's promises were from being broken, in one recording and in a run.

The extra `promises` brings what evaluates the formulas.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

from hil.recordings.recording import Recording
from hil.verdict.promise_signals import signals
from hil.verdict.promises import PROMISES, YES, Promise

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Margin:
    """How far one promise was from being broken."""

    promise: Promise
    value: float
    """In the promise's unit; below zero when it was broken, `YES` or more when it was not put to the test."""

    @property
    def tested(self) -> bool:
        """Whether anything happened that the promise speaks of."""
        return abs(self.value) < YES / 2

    @property
    def share(self) -> float:
        """Part of a comfortable margin."""
        return self.value / self.promise.scale


def available() -> bool:
    """Return whether the extra is installed."""
    return find_spec("sentil") is not None


def margin(promise: Promise, times: Floats, values: Mapping[str, Floats]) -> Margin:
    """Evaluate a promise on signals (n,) at times (n,) s.

    Raises:
        KeyError: a signal is missing.
    """
    from sentil import Formula, Trace  # noqa: PLC0415 - an extra

    trace = Trace(times, {name: values[name] for name in promise.signals})
    return Margin(promise, float(Formula.parse(promise.formula).robustness(trace)))


def margins(recording: Recording) -> tuple[Margin, ...]:
    """Return the margins of a recording of a guarded hand that the guard did not stop, none for another.

    From its beginning to its end such a hand is moved by its program.
    """
    if not recording.header.safety or not recording.header.finished or not recording.wire:
        return ()
    times, found = signals(recording.wire, recording.wire[-1].t)
    moving = {"moving": np.full(len(times), YES)}
    return tuple(margin(promise, times, {**found, **moving}) for promise in PROMISES if promise.recorded)


@dataclass(frozen=True)
class MarginLeft:
    """The smallest margin of one promise."""

    margin: Margin
    experiment: str
    """In whose recording it was."""

    @property
    def text(self) -> str:
        """The margin with its unit."""
        return f"{self.margin.value:.3g} {self.margin.promise.unit}" if self.margin.tested else "not put to the test"


def margins_left(recordings: Iterable[Recording]) -> tuple[MarginLeft, ...]:
    """Return the smallest margin of each promise over recordings of guarded hands; none without extra `promises`."""
    if not available():
        return ()
    smallest: dict[str, MarginLeft] = {}
    for recording in recordings:
        for found in margins(recording):
            before = smallest.get(found.promise.name)
            if before is None or found.value < before.margin.value:
                smallest[found.promise.name] = MarginLeft(found, recording.header.experiment)
    return tuple(smallest.values())


def nearest(left: Iterable[MarginLeft]) -> str:
    """Return one line about the promise that came nearest to being broken, empty when there is none."""
    tested: Mapping[float, MarginLeft] = {one.margin.share: one for one in left if one.margin.tested}
    if not tested:
        return ""
    one = tested[min(tested)]
    return f"the guard's promise that came nearest to being broken: {one.margin.promise.name}, {one.text} left"
