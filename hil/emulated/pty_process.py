"""Emulated hand in a child process, for the target `pty`."""

import json
import logging
import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from queue import Empty, SimpleQueue

from aero.child_process import ChildError, ChildProcess
from aero.firmware import DEFAULT_FIRMWARE
from aero.side import Side
from hil.emulated import served_hand
from hil.emulated.emulated_spec import EmulatedSpec, parsed_faults
from hil.emulated.faults.bench import BenchState, HandBench
from hil.emulated.faults.fault import Injection
from hil.emulated.served_hand import ACTED, NEVER_FIRED, OBSERVED, RENEWED, TELEMETRY, spec_text
from hil.emulated.telemetry import TrueMotion
from hil.targets.argument_names import suggesting
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
        self.samples: SimpleQueue[str] = SimpleQueue()
        self._delays = delays

    def take(self, line: str) -> None:
        """Parse one line."""
        word, _, rest = line.partition(" ")
        if word == LATE:
            self._delays.add(float(rest), Loop.BOARD)
        elif word == NEVER_FIRED:
            self.unfired.append(rest)
        elif word in (ACTED, RENEWED):
            self.answers.put(rest)
        elif word == TELEMETRY:
            self.samples.put(rest)


class ServedPort(HandBench):
    """Emulated hand behind a path, for any program: sends acts to its process and receives one line in answer."""

    def __init__(self, child: ChildProcess, heard: _Heard, spec: EmulatedSpec, ready: str) -> None:
        self.path, _, self.url = ready.partition(" ")
        """Path of the pseudo-terminal, and pyserial URL of the same hand; the URL is empty unless observed."""
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
        self._ask(" ".join(words.split()))
        return self._state.done[-1][1]

    def telemetry(self) -> TrueMotion:
        """Return the true state of an observed hand since it was switched on.

        Raises:
            ChildError: the child has exited, or does not answer.
        """
        self._ask(TELEMETRY)
        return TrueMotion.of(json.loads(self._heard.samples.get_nowait()))

    def renew(self, faults: Iterable[Injection | str] = ()) -> None:
        """Replace the hand by a new one with these faults, behind another path.

        Raises:
            ValueError: an unknown fault, or faults that the hand refuses.
            FaultNeverFiredError: a fault of the earlier hand had no effect.
            ChildError: the child has exited, or does not answer.
        """
        self._ask(" ".join((RENEWED, *map(str, faults))))
        self.path, _, self.url = self._answered("a new hand").partition(" ")
        self._state = BenchState(faults=" ".join(map(str, faults)))
        if self._heard.unfired:
            unfired, self._heard.unfired = self._heard.unfired, []
            raise FaultNeverFiredError(unfired)

    def _ask(self, line: str) -> None:
        try:
            self._child.send(f"{line}\n")
        except BrokenPipeError as error:
            raise ChildError(f"{NAME} did not answer {line!r}: {self._child.errors}") from error
        answer = json.loads(self._answered(line))
        done = tuple((t, text) for t, text in answer["done"])
        self._state = BenchState(tuple(answer["acts"]), done, answer["faults"])
        if answer["refused"]:
            raise ValueError(answer["refused"])

    def _answered(self, asked: str) -> str:
        try:
            return self._heard.answers.get(timeout=ANSWER_S)
        except Empty as error:
            raise ChildError(f"{NAME} did not answer {asked!r}: {self._child.errors}") from error


@contextmanager
def serve_in_child(
    spec: EmulatedSpec, delays: DelayLog | None = None, *, observed: bool = False
) -> Iterator[tuple[str, ServedPort]]:
    """Start an emulated hand on a pseudo-terminal; yield its path and port.

    `delays` receives the board's delays. An `observed` hand has telemetry and a URL.

    Raises:
        FaultNeverFiredError: a fault had no effect before the child was stopped.
        ChildError: the child did not start, or did not stop cleanly; the message contains its error output.
    """
    command = [
        sys.executable,
        "-P",
        "-m",
        served_hand.__name__,
        spec_text(spec),
        str(os.getpid()),
        OBSERVED if observed else "",
    ]
    heard = _Heard(delays or DelayLog())
    child = ChildProcess(command, NAME, on_line=heard.take)
    ready = child.wait_ready(START_S)
    try:
        port = ServedPort(child, heard, spec, ready)
        yield port.path, port
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


@suggesting
@contextmanager
def serve(
    *,
    unit: str = "reference",
    side: Side = "right",
    firmware: str = DEFAULT_FIRMWARE,
    faults: Iterable[Injection | str] = (),
    seed: int = 0,
    homed: bool = False,
    firmware_program: Path | None = None,
) -> Iterator[ServedPort]:
    """Serve an emulated hand on a pseudo-terminal, in real time, for a driver in any language.

    Args: as for `hil.emulate`.

    Raises:
        ValueError: an unknown unit, side, firmware or fault, or fields that cannot be combined.
        FaultNeverFiredError: a fault had no effect; raised at the end of a context without another error.
        ChildError: the serving process did not start, or did not stop cleanly.
    """
    spec = EmulatedSpec(
        "pty", firmware, side, unit=unit, seed=seed, homed=homed, faults=parsed_faults(faults),
        firmware_program=firmware_program,
    )  # fmt: skip
    with serve_in_child(spec, observed=True) as (_, port):
        yield port
