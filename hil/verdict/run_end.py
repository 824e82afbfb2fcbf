"""How a run ended, as one value: in which way, at which experiment, why, and what was recorded until then."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

from aero.safety import SafetyStopError
from hil.faults import FaultNeverFiredError
from hil.recordings.recording import Recording
from hil.verdict.findings import Finding


class Way(Enum):
    """How a run may end; the values are what a finding says, `{at}` and `{reason}` being those of the run.

    Check, measured, expected, source, meaning, remedy.
    """

    FINISHED = ()
    """Everything that was asked for was run."""
    GATE = (
        "after {at}",
        "not run",
        "run",
        "a hand that fails {at} is not moved further",
        "The checks of {at} failed, so nothing that moves the hand through its range was run.",
        "Mend what {at} found, then validate again.",
    )
    """A gate failed."""
    GUARD = (
        "{at}",
        "not run",
        "run",
        "the guard",
        "{reason}",
        "Validate with firmware 0.1.0 or later, or run the other experiments.",
    )
    """The guard permits none of the experiments that were asked for."""
    DRIVER = (
        "{at}",
        "broken off",
        "run to its end",
        "the driver",
        "{reason}",
        "Mend this first; what comes after it was not run.",
    )
    """Driver, guard or link ended an experiment with an error."""
    PERSON = (
        "{at}",
        "broken off",
        "run to its end",
        "a person or a signal",
        "The program was told to stop.",
        "Run it again.",
    )
    CUT = (
        "{at}",
        "broken off",
        "run to its end",
        "the recording",
        "The recording ends before the experiment does.",
        "Run it again.",
    )
    """A recording that is judged does not come to its end."""
    NO_FAULT = (
        "fault",
        "absent",
        "present",
        "--fault",
        "{reason}",
        "What was measured is that of a hand without it.",
    )
    """A fault that was asked for never had an effect: what was measured stands, a verdict does not."""
    NOT_OPENED = (
        "opening",
        "stopped",
        "open and weak at the end",
        "the guard",
        "{reason}",
        "Look at the hand before anything else. What was measured stands.",
    )
    """Everything was run, and the guard could not leave the hand open and weak as it does after every program."""


@dataclass(frozen=True)
class RunEnd:
    """How one run ended."""

    way: Way
    at: str = ""
    """Experiments it is about."""
    reason: str = ""
    error: BaseException | None = None
    """What ended the program's work on the hand; it decides the exit code."""
    cut: tuple[Recording, ...] = ()
    """What experiments that did not end had recorded until then."""

    @property
    def finding(self) -> Finding | None:
        """What kept the rest from running, None when all ran."""
        if self.way is Way.FINISHED:
            return None
        check, *texts = (text.format(at=self.at, reason=self.reason) for text in self.way.value)
        return Finding(check, "hand", False, *texts)

    @property
    def error_name(self) -> str:
        """Name of the kind of error, as the dictionary of faults knows it; empty when there was none."""
        return "" if self.error is None else type(self.error).__name__


FINISHED = RunEnd(Way.FINISHED)


def broken_off(experiment: str, error: BaseException, cut: tuple[Recording, ...]) -> RunEnd:
    """Return the end of a run whose experiment an error ended."""
    way = Way.PERSON if isinstance(error, (KeyboardInterrupt, SystemExit)) else Way.DRIVER
    return RunEnd(way, experiment, str(error), error, cut)


def ended_at_closing(end: RunEnd, error: FaultNeverFiredError | SafetyStopError) -> RunEnd:
    """Return the end of a run when closing its hand ended with an error; how its experiments ended stays."""
    if end is not FINISHED:
        return replace(end, error=error)
    way = Way.NO_FAULT if isinstance(error, FaultNeverFiredError) else Way.NOT_OPENED
    reason = f"{str(error)[0].upper()}{str(error)[1:]}".rstrip(".")
    return RunEnd(way, reason=f"{reason}.", error=error)
