"""End of a run as one value: kind, experiment, reason, channel, partial recordings."""

from dataclasses import dataclass, replace
from enum import Enum

from aero.channels import Channel
from aero.errors import AeroError
from aero.printable import capital
from aero.safety import SafetyReason, SafetyStopError
from hil.recordings.errors import CannotBeWrittenError
from hil.recordings.recording import Recording
from hil.targets.hand_errors import FaultNeverFiredError
from hil.verdict.findings import Finding


class EndKind(Enum):
    """Kinds of a run's end; values are texts of the finding, formatted with `{at}` and `{reason}`.

    Order: check, measured, expected, source, meaning, remedy.
    """

    FINISHED = ()
    """All requested experiments were run."""
    GATE = (
        "motion through the range",
        "not run",
        "run",
        "a hand that fails {at} is not moved further",
        "Checks of {at} failed.",
        "Repair what {at} found, then validate again.",
    )
    NOT_PERMITTED = (
        "{at}",
        "not run",
        "run",
        "the guard",
        "{reason}",
        "Validate with firmware 0.1.0 or later, or run the other experiments.",
    )
    STOPPED = (
        "{at}",
        "aborted",
        "run to its end",
        "the guard",
        "{reason}",
        "Continue with the next step; the remaining experiments were not run.",
    )
    LINK = (
        "{at}",
        "aborted",
        "run to its end",
        "the driver",
        "{reason}",
        "Continue with the next step; the remaining experiments were not run.",
    )
    """Driver or link ended an experiment with an error."""
    FIRMWARE = (
        "{at}",
        "aborted",
        "run to its end",
        "the firmware program",
        "{reason}",
        "Fix the firmware; the remaining experiments were not run.",
    )
    NOT_WRITTEN = (
        "{at}",
        "aborted",
        "run to its end",
        "the disk",
        "{reason}",
        "Make room on the disk, or choose another folder by --out; no statement about the hand.",
    )
    INTERRUPTED = (
        "{at}",
        "aborted",
        "run to its end",
        "a person or a signal",
        "The program was interrupted.",
        "Run it again.",
    )
    HOST_BUSY = (
        "{at}",
        "not judged",
        "judged",
        "this computer",
        "{reason}",
        "Close other programs on this computer, then validate again.",
    )
    """Scheduling delays of this computer were too frequent for a verdict."""
    INCOMPLETE = (
        "{at}",
        "aborted",
        "run to its end",
        "the recording",
        "The recording is truncated.",
        "Run it again.",
    )
    """A judged recording is truncated."""
    FAULT_NEVER_FIRED = (
        "fault",
        "absent",
        "present",
        "--fault",
        "{reason}",
        "The measured values are of a hand without the fault.",
    )
    """A requested fault never took effect: readings stay valid, without a verdict."""
    NOT_OPENED = (
        "opening",
        "stopped",
        "open and weak at the end",
        "the guard",
        "{reason}",
        "Inspect the hand first. The measured values are valid.",
    )
    """All experiments ran, but the guard could not open and weaken the hand afterwards."""


NO_EVIDENCE = {EndKind.INTERRUPTED, EndKind.INCOMPLETE, EndKind.NOT_WRITTEN, EndKind.HOST_BUSY}
"""Ends without evidence about the hand."""


@dataclass(frozen=True)
class RunEnd:
    """End of one run."""

    kind: EndKind
    at: str = ""
    """Experiments concerned."""
    reason: str = ""
    """Reason, for the user."""
    error: BaseException | None = None
    """Error that ended the work on the hand; determines the exit code."""
    cut: tuple[Recording, ...] = ()

    @property
    def finding(self) -> Finding | None:
        """Finding about a run that was cut short; None if all experiments ran."""
        if self.kind is EndKind.FINISHED:
            return None
        check, *texts = (text.format(at=self.at, reason=self.reason) for text in self.kind.value)
        return Finding(check, "hand", False, *texts)

    @property
    def stop(self) -> SafetyReason | None:
        """Reason of a guard stop; None for other ends."""
        return self.error.reason if isinstance(self.error, SafetyStopError) else None

    @property
    def channel(self) -> Channel | None:
        """Channel that caused a guard stop; None for other ends."""
        return self.error.channel if isinstance(self.error, SafetyStopError) else None

    @property
    def error_name(self) -> str:
        """Class name of the error; empty without an error."""
        return "" if self.error is None else type(self.error).__name__


FINISHED = RunEnd(EndKind.FINISHED)
END_BY_ERROR: dict[type[BaseException], EndKind] = {
    SafetyStopError: EndKind.STOPPED,
    CannotBeWrittenError: EndKind.NOT_WRITTEN,
    AeroError: EndKind.LINK,
    OSError: EndKind.LINK,
    KeyboardInterrupt: EndKind.INTERRUPTED,
    SystemExit: EndKind.INTERRUPTED,
}
"""Kind of end by error; the first matching class counts, and others are errors of a firmware program. Partial
recordings are saved."""


def aborted(experiment: str, error: BaseException, cut: tuple[Recording, ...]) -> RunEnd:
    """Return the end of a run whose experiment was aborted by an error of `END_BY_ERROR` or `Target.program_errors`."""
    kind = next((kind for errors, kind in END_BY_ERROR.items() if isinstance(error, errors)), EndKind.FIRMWARE)
    return RunEnd(kind, experiment, str(error), error, cut)


def ended_at_closing(end: RunEnd, error: FaultNeverFiredError | SafetyStopError) -> RunEnd:
    """Return the end of a run whose closing failed with an error; an earlier end keeps its kind."""
    if end is not FINISHED:
        return replace(end, error=error)
    kind = EndKind.FAULT_NEVER_FIRED if isinstance(error, FaultNeverFiredError) else EndKind.NOT_OPENED
    reason = f"{capital(str(error))}".rstrip(".")
    return RunEnd(kind, reason=f"{reason}.", error=error)
