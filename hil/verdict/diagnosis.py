"""What is said of a run that failed: what is suspected, the evidence for it, and the step that says most."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path

from aero.channels import Channel
from hil.recordings.recording import Header
from hil.targets.hands_file import IN_SOFTWARE
from hil.verdict.case import DiagnosisCase
from hil.verdict.findings import Finding
from hil.verdict.parts import Suspect, listed, place


@dataclass(frozen=True)
class NextStep:
    """One thing to do."""

    do: str
    command: str = ""
    """As a shell takes it; empty for one without."""


@dataclass(frozen=True)
class Diagnosis:
    """What the failed findings of a run say together. None of its suspects is convicted: that takes a step."""

    suspects: tuple[Suspect, ...] = ()
    """The ambiguity group; empty if nothing failed, or nothing that tells about a part."""
    clues: tuple[str, ...] = ()
    """Observations behind the suspects, sentences without a full stop."""
    evidence: tuple[Finding, ...] = ()
    """Failed findings that the suspects explain."""
    unexplained: tuple[Finding, ...] = ()
    """The other failed findings."""
    case: DiagnosisCase | None = None
    """The case that the run opens; None where nothing tells about a part."""
    step: NextStep | None = None
    """The next step of the case, or another action; None when nothing failed."""
    observations: tuple[str, ...] = ()
    """What the curves of the suspected channels show besides, sentences without a full stop; none names a cause."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels of the suspects."""
        return tuple(dict.fromkeys(s.channel for s in self.suspects if s.channel is not None))

    @property
    def place(self) -> str:
        """Where something is wrong, for a heading; empty where nothing tells."""
        return place(self.suspects)

    @property
    def sentence(self) -> str:
        """What was observed and what is suspected, for people."""
        if not self.clues:
            return ""
        seen = "; ".join(self.clues)
        return f"{seen[0].upper()}{seen[1:]}. Suspected: {listed(map(str, self.suspects))}; no test has shown which."


NOTHING = Diagnosis()
"""Of a run in which nothing is wrong."""


def command_again(header: Header) -> str:
    """Return the command that made a recording, without the path of its program; empty where a program made it."""
    program, _, rest = header.command.partition(" ")
    return f"{Path(program).name} {rest}" if header.command else ""


def command_of_case(header: Header | None, folder: Path | None) -> str:
    """Return the command that takes a failed run up; of recordings whose hand is not known there is none.

    Args:
        header: of a recording of the run.
        folder: of its case; the latest run's when None.
    """
    if header is None:
        return ""
    # An emulated hand is made anew, with the faults of the case.
    hand = [] if header.target in IN_SOFTWARE else ["--hil", header.target]
    return shlex.join(["aero-hil", "diagnose", *([] if folder is None else [str(folder)]), *hand])
