"""What a check says: a verdict, what was found, and what to do about it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Any


class Verdict(StrEnum):
    """From good to bad."""

    OK = "ok"
    LOOK = "look"
    """Worth a look: it works, or may work, but not as well as it could."""
    WRONG = "wrong"
    """Something will not work until this is put right."""


class Subject(StrEnum):
    """What a finding is about; a broken machine must never look like a broken hand."""

    MACHINE = "machine"
    LINK = "link"
    """The port that was named, and whether a hand answers there."""
    HAND = "hand"


@dataclass(frozen=True)
class Examined:
    """One line of the table."""

    check: str
    """Name of the check, which stays the same from version to version."""
    verdict: Verdict
    finding: str
    """What was found, in a sentence or less."""
    remedy: str = ""
    """What to do; empty where there is nothing to do."""
    copy: tuple[str, ...] = ()
    """Lines to copy as they are."""
    subject: Subject = Subject.MACHINE
    data: Mapping[str, Any] = field(default_factory=dict)
    """The same in figures, for programs: what JSON can hold."""

    def as_dict(self) -> dict[str, Any]:
        """Return it for JSON."""
        return asdict(self)


def worst(findings: Iterable[Examined], *subjects: Subject) -> Verdict:
    """Return the worst verdict, of findings about some subjects or, without any, of all."""
    order = list(Verdict)
    verdicts = [finding.verdict for finding in findings if not subjects or finding.subject in subjects]
    return max(verdicts, key=order.index, default=Verdict.OK)
