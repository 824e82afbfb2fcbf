"""Emulated hand in a child process, for the target `pty`."""

import json
import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from queue import Empty, SimpleQueue

from aero.child_process import ChildError, ChildProcess
from hil.emulated import served_hand
from hil.emulated.emulated_spec import EmulatedSpec
from hil.emulated.faults.bench import BenchState, HandBench
from hil.emulated.served_hand import ACTED, NEVER_FIRED, spec_text
from hil.targets.delays import LATE, DelayLog, Loop
from hil.targets.hand_errors import FaultNeverFiredError

_LOG = logging.getLogger(__name__)
NAME = "the process of the emulated hand"
START_S = 120.0
"""Time-out of the child's start, s; loading the physics engine and homing take 1 s on an idle machine."""
STOP_S = 10.0
"""Time-out of the child's exit after SIGTERM, s."""
ANSWER_S = 10.0
"""Time-out of an act, s."""


class _Heard:
    """Parser of the child's output lines other than `ready`."""

    def __init__(self, delays: DelayLog) -> None:
        self.unfired: list[str] = []
        self.answers: SimpleQueue[str] = SimpleQueue()
        self._delays = delays

    def take(self, line: str) -> None:
        """Parse one line."""
        word, _, rest = line.partition(" ")
        if word == LATE:
            self._delays.add(float(rest), Loop.BOARD)
        elif word == NEVER_FIRED:
            self.unfired.append(rest)
        elif word == ACTED:
            self.answers.put(rest)


class _ServedBench(HandBench):
    """Bench of the child: sends each act to its standard input and receives one line in answer."""

    def __init__(self, child: ChildProcess, heard: _Heard, spec: EmulatedSpec) -> None:
        self._child, self._heard = child, heard
        self._state = BenchState(faults=" ".join(map(str, spec.faults)))

    def state(self) -> BenchState:
        """Return the state after the last act."""
        return self._state

    def act(self, words: str) -> str:
        """Perform an act and return a sentence about it.

        Raises:
            ValueError: the hand refuses the act.
            ChildError: the child has exited, or does not answer.
        """
        try:
            self._child.send(f"{' '.join(words.split())}\n")
            answer = json.loads(self._heard.answers.get(timeout=ANSWER_S))
        except (BrokenPipeError, Empty) as error:
            raise ChildError(f"{NAME} did not answer {words!r}: {self._child.errors}") from error
        done = tuple((t, text) for t, text in answer["done"])
        self._state = BenchState(tuple(answer["acts"]), done, answer["faults"])
        if answer["refused"]:
            raise ValueError(answer["refused"])
        return self._state.done[-1][1]


@contextmanager
def serve_in_child(spec: EmulatedSpec, delays: DelayLog | None = None) -> Iterator[tuple[str, HandBench]]:
    """Start an emulated hand on a pseudo-terminal; yield path and bench. `delays` receives the board's delays.

    Raises:
        FaultNeverFiredError: a fault had no effect before the child was stopped.
        ChildError: the child did not start, or did not stop cleanly; the message contains its error output.
    """
    command = [sys.executable, "-P", "-m", served_hand.__name__, spec_text(spec), str(os.getpid())]
    heard = _Heard(delays or DelayLog())
    child = ChildProcess(command, NAME, on_line=heard.take)
    path = child.wait_ready(START_S)
    try:
        yield path, _ServedBench(child, heard, spec)
    except BaseException:
        try:
            child.end(STOP_S)
        except ChildError as error:  # the earlier exception is the cause
            _LOG.warning("%s", error)
        raise
    status = child.end(STOP_S)
    if heard.unfired:
        raise FaultNeverFiredError(heard.unfired)
    if status:
        raise ChildError(f"{NAME} ended with status {status}: {child.errors}")
