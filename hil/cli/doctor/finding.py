"""Finding of an examination: verdict, observation, remedy."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Any


class Verdict(StrEnum):
    """Verdict, ordered from good to bad."""

    OK = "ok"
    LOOK = "look"
    """Working, perhaps with limitations."""
    WRONG = "wrong"
    """Not working until the remedy is applied."""


class Subject(StrEnum):
    """Subject of a finding, so that a machine's fault is not mistaken for a hand's."""

    MACHINE = "machine"
    LINK = "link"
    """Named port, including whether a hand answers."""
    HAND = "hand"


@dataclass(frozen=True)
class Examined:
    """One line of the table."""

    check: str
    verdict: Verdict
    finding: str
    """Observation, at most one sentence."""
    remedy: str = ""
    """Action to take; empty if none is needed."""
    copy: tuple[str, ...] = ()
    subject: Subject = Subject.MACHINE
    data: Mapping[str, Any] = field(default_factory=dict)
    """Figures of the finding, JSON-compatible."""

    def as_dict(self) -> dict[str, Any]:
        """Return the finding as a JSON-compatible dict."""
        return asdict(self)


def worst(findings: Iterable[Examined], *subjects: Subject) -> Verdict:
    """Return the worst verdict of findings about these subjects, or of all findings without subjects."""
    order = list(Verdict)
    verdicts = [finding.verdict for finding in findings if not subjects or finding.subject in subjects]
    return max(verdicts, key=order.index, default=Verdict.OK)
