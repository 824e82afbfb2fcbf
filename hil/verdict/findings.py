"""A finding, one reading compared with its limit in words a builder of the hand can act on; and what was not judged."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum

from hil.checks.shared.subjects import subject_words


@dataclass(frozen=True)
class Finding:
    """One check of one subject."""

    check: str
    """What was checked, a stable name such as `tracking_rms`."""
    subject: str
    """What it was checked on: a channel's label, or `hand`."""
    passed: bool
    measured: str
    """What was measured, as people read it, with unit."""
    expected: str
    """What it should be, for example `at most 0.9 mm`."""
    source: str
    """Where the expectation comes from."""
    meaning: str = ""
    """How the run ended, in words; empty for a reading, which names no cause."""
    remedy: str = ""
    """Action after that ending; empty for a reading."""
    words: str = ""
    """What was checked, for people; the check's name with blanks when empty."""
    experiment: str = ""
    """The check's folder; empty for what is about the run."""
    excess: float | None = 0.0
    """How far it lies beyond healthy readings, see `Limit.excess`: beyond 1 it fails, negative is too low. None when it
    could not be measured: it did not pass, and says nothing about any part."""

    @property
    def name(self) -> str:
        """What was checked, for people."""
        return self.words or self.check.replace("_", " ")

    @property
    def sentence(self) -> str:
        """The finding in one sentence."""
        where = subject_words(self.subject)
        return f"{where[0].upper()}{where[1:]}: {self.name} is {self.measured}, should be {self.expected}"


class Why(Enum):
    """Why a reading was not judged; the values are for people, inside a sentence."""

    HELD_UP = "this computer was held up"
    LATE_THROUGHOUT = "this computer or its link was late throughout"
    LATE_SAMPLES = "too many readings came late"
    """On virtual time, where no computer is late: the link's replies were."""
    NO_BYTES = "the recording holds no bytes of the link"
    NO_LIMIT = "there is no limit for it"
    NO_MOTION = "its channel does not move"


class MissingReadingError(Exception):
    """A check did not return a reading that it declares, and nothing excuses it: a defect of the check."""


@dataclass(frozen=True)
class Withheld:
    """A reading that was not judged, and why."""

    experiment: str
    metric: str
    subject: str
    words: str
    """Name of the metric for people."""
    why: Why
    held_up_s: float = 0.0
    """How long this computer was held up meanwhile, s; 0 for any cause but `Why.HELD_UP`."""

    @property
    def reason(self) -> str:
        """Why, inside a sentence."""
        return self.why.value + (f" for {1e3 * self.held_up_s:.0f} ms" if self.why is Why.HELD_UP else "")

    @property
    def sentence(self) -> str:
        """The same in one sentence."""
        where = subject_words(self.subject)
        return f"{where[0].upper()}{where[1:]}: {self.words} was not judged: {self.reason}"


@dataclass(frozen=True)
class Tally:
    """How many checks of a run passed, failed, could not be measured, and were not judged: the one count shown."""

    passed: int
    failed: int
    withheld: int
    unmeasured: int = 0
    """Checks whose reading the hand did not let be measured: neither passed nor failed."""

    @property
    def words(self) -> str:
        """The count in one sentence without a full stop."""
        asked = self.passed + self.failed + self.unmeasured
        if self.failed:
            words = f"{self.failed} of {asked} checks failed"
        else:
            words = f"{self.passed} of {asked} checks passed" if self.unmeasured else f"all {asked} checks passed"
        others = ((self.unmeasured, "not measurable"), (self.withheld, "not judged"))
        return ", ".join((words, *(f"{count} {what}" for count, what in others if count)))


def failed(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Return those that did not pass, those that could not be measured among them."""
    return tuple(finding for finding in findings if not finding.passed)
