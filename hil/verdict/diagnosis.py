"""Diagnosis of a failed run: suspects, evidence and the most informative next step."""

import shlex
from dataclasses import dataclass
from pathlib import Path

from aero.channels import Channel
from aero.printable import capital
from hil.recordings.recording import Header
from hil.targets.hands_file import EMULATED_TARGETS, called
from hil.verdict.case import DiagnosisCase
from hil.verdict.findings import Finding
from hil.verdict.parts import Suspect, listed, place


@dataclass(frozen=True)
class NextStep:
    """Next action for the user."""

    do: str
    command: str = ""
    """Shell command; empty if the action has none."""


@dataclass(frozen=True)
class Diagnosis:
    """Joint diagnosis of a run's failed findings; only a step can convict a suspect."""

    suspects: tuple[Suspect, ...] = ()
    """Ambiguity group; empty if no failure points to a part."""
    clues: tuple[str, ...] = ()
    """Observations behind the suspects, sentences without a full stop."""
    evidence: tuple[Finding, ...] = ()
    """Failed findings that the suspects explain."""
    unexplained: tuple[Finding, ...] = ()
    """Failed findings that the suspects do not explain."""
    case: DiagnosisCase | None = None
    """Case opened by the run, or None if no failure points to a part."""
    step: NextStep | None = None
    """Next step of the case, or another action; None if nothing failed."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Channels of the suspects."""
        return tuple(dict.fromkeys(s.channel for s in self.suspects if s.channel is not None))

    @property
    def place(self) -> str:
        """Location of the failure for a heading; empty if unknown."""
        return place(self.suspects)

    @property
    def sentence(self) -> str:
        """Sentence with the clues and suspects, for the user."""
        if not self.clues:
            return ""
        seen = "; ".join(self.clues)
        return f"{capital(seen)}. {self.suspected}"

    @property
    def suspected(self) -> str:
        """Sentence with the suspects; there must be some."""
        return f"Suspected: {listed(map(str, self.suspects))}; no test has shown which."


NOTHING = Diagnosis()


def command_again(header: Header) -> str:
    """Return the recorded shell command without the program's path; empty if no shell command made the recording."""
    program, _, rest = header.command.partition(" ")
    return f"{Path(program).name} {rest}" if header.command else ""


def command_of_case(header: Header | None, folder: Path | None) -> str:
    """Return the command that continues the diagnosis of a failed run; empty if the hand is unknown.

    Args:
        header: header of a recording of the run.
        folder: folder of the case; None for the latest run's.
    """
    if header is None:
        return ""
    # an emulated hand is recreated with the faults of the case
    hand = [] if header.target in EMULATED_TARGETS else ["--hil", called(header.target, header.hand_id)]
    return shlex.join(["aero-hil", "diagnose", *([] if folder is None else [str(folder)]), *hand])
