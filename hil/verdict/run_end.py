"""How a run ended, as one value: in which way, at which experiment, why, on which channel, and what was recorded."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

from aero.channels import Channel
from aero.errors import AeroError
from aero.safety import SafetyReason, SafetyStopError
from firmware_emulator.native.program import FirmwareProgramError
from hil.faults import FaultNeverFiredError
from hil.recordings.errors import CannotBeWrittenError
from hil.recordings.recording import Recording
from hil.verdict.findings import Finding


class EndKind(Enum):
    """The ways in which a run may end; the values are what a finding says, with `{at}` and `{reason}` of the run.

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
    NOT_PERMITTED = (
        "{at}",
        "not run",
        "run",
        "the guard",
        "{reason}",
        "Validate with firmware 0.1.0 or later, or run the other experiments.",
    )
    """The guard permits none of the experiments that were asked for."""
    STOPPED = (
        "{at}",
        "aborted",
        "run to its end",
        "the guard",
        "{reason}",
        "Go on with the next step; what comes after {at} was not run.",
    )
    """The guard stopped the hand."""
    LINK = (
        "{at}",
        "aborted",
        "run to its end",
        "the driver",
        "{reason}",
        "Go on with the next step; what comes after {at} was not run.",
    )
    """Driver or link ended an experiment with an error."""
    FIRMWARE = (
        "{at}",
        "aborted",
        "run to its end",
        "the firmware program",
        "{reason}",
        "Mend the firmware; what comes after it was not run.",
    )
    NOT_WRITTEN = (
        "{at}",
        "aborted",
        "run to its end",
        "the disk",
        "{reason}",
        "Make room on the disk, or choose another folder by --out; this says nothing about the hand.",
    )
    """A recording could not be written."""
    INTERRUPTED = (
        "{at}",
        "aborted",
        "run to its end",
        "a person or a signal",
        "The program was told to stop.",
        "Run it again.",
    )
    HOST_BUSY = (
        "{at}",
        "not judged",
        "judged",
        "this computer",
        "{reason}",
        "Close what else runs on this computer, then validate again.",
    )
    """This computer was too late too often for a verdict."""
    INCOMPLETE = (
        "{at}",
        "aborted",
        "run to its end",
        "the recording",
        "The recording ends before the experiment does.",
        "Run it again.",
    )
    """A recording that is judged does not come to its end."""
    FAULT_NEVER_FIRED = (
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


SAYS_NOTHING = {EndKind.INTERRUPTED, EndKind.INCOMPLETE, EndKind.NOT_WRITTEN, EndKind.HOST_BUSY}
"""Endings that say nothing about the hand."""


@dataclass(frozen=True)
class RunEnd:
    """How one run ended."""

    kind: EndKind
    at: str = ""
    """Experiments it is about."""
    reason: str = ""
    """Why, for people."""
    error: BaseException | None = None
    """What ended the program's work on the hand; it decides the exit code."""
    cut: tuple[Recording, ...] = ()
    """What experiments that did not end had recorded until then."""

    @property
    def finding(self) -> Finding | None:
        """What kept the rest from running, None when all ran."""
        if self.kind is EndKind.FINISHED:
            return None
        check, *texts = (text.format(at=self.at, reason=self.reason) for text in self.kind.value)
        return Finding(check, "hand", False, *texts)

    @property
    def stop(self) -> SafetyReason | None:
        """Why the guard stopped the hand; None for every other end."""
        return self.error.reason if isinstance(self.error, SafetyStopError) else None

    @property
    def channel(self) -> Channel | None:
        """The channel for which the guard stopped the hand; None for every other end."""
        return self.error.channel if isinstance(self.error, SafetyStopError) else None

    @property
    def error_name(self) -> str:
        """Name of the kind of error; empty when there was none."""
        return "" if self.error is None else type(self.error).__name__


FINISHED = RunEnd(EndKind.FINISHED)
END_BY_ERROR: dict[type[BaseException], EndKind] = {
    SafetyStopError: EndKind.STOPPED,
    FirmwareProgramError: EndKind.FIRMWARE,
    CannotBeWrittenError: EndKind.NOT_WRITTEN,
    AeroError: EndKind.LINK,
    OSError: EndKind.LINK,
    KeyboardInterrupt: EndKind.INTERRUPTED,
    SystemExit: EndKind.INTERRUPTED,
}
"""Error that aborts a run to its kind of ending; the first class that fits counts. What was recorded is saved."""


def aborted(experiment: str, error: BaseException, cut: tuple[Recording, ...]) -> RunEnd:
    """Return the end of a run whose experiment an error of `END_BY_ERROR` ended."""
    kind = next(kind for errors, kind in END_BY_ERROR.items() if isinstance(error, errors))
    return RunEnd(kind, experiment, str(error), error, cut)


def ended_at_closing(end: RunEnd, error: FaultNeverFiredError | SafetyStopError) -> RunEnd:
    """Return the end of a run when closing its hand ended with an error; how its experiments ended stays."""
    if end is not FINISHED:
        return replace(end, error=error)
    kind = EndKind.FAULT_NEVER_FIRED if isinstance(error, FaultNeverFiredError) else EndKind.NOT_OPENED
    reason = f"{str(error)[0].upper()}{str(error)[1:]}".rstrip(".")
    return RunEnd(kind, reason=f"{reason}.", error=error)
