"""Findings (one reading each, compared with its limit) and readings that were not judged."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum

from aero.printable import capital
from hil.checks import metric_of
from hil.checks.shared.declaration import Metric
from hil.checks.shared.subjects import subject_words


@dataclass(frozen=True)
class Finding:
    """Result of one check of one subject."""

    check: str
    """Stable name of the metric, such as `tracking_rms`."""
    subject: str
    """Label of a channel, or `hand`."""
    passed: bool
    measured: str
    expected: str
    """Allowed range as text, for example `at most 0.9 mm`."""
    source: str
    """Origin of the expectation."""
    meaning: str = ""
    """Explanation of how the run ended; empty for a reading."""
    remedy: str = ""
    """Action after such an ending; empty for a reading."""
    words: str = ""
    """Display name; if empty, the check's name with blanks."""
    experiment: str = ""
    """Folder of the check; empty for a finding about the run."""
    excess: float | None = 0.0
    """Excess beyond healthy readings (`Limit.excess`): fails above 1, negative if too low.

    None marks an unmeasurable reading, which fails and is evidence of no part.
    """

    @property
    def name(self) -> str:
        """Display name of the check."""
        return self.words or self.check.replace("_", " ")

    @property
    def metric(self) -> Metric | None:
        """Metric of the reading; None for a finding about the run."""
        return metric_of(self.experiment, self.check, self.subject)

    @property
    def strength(self) -> float:
        """Magnitude of the excess; 0 if unmeasurable."""
        return 0.0 if self.excess is None else abs(self.excess)

    @property
    def sentence(self) -> str:
        """Finding as one sentence."""
        where = subject_words(self.subject)
        return f"{capital(where)}: {self.name} {self.measured}, should be {self.expected}"


class NotJudgedReason(Enum):
    """Reason why a reading was not judged; values are phrases for sentences."""

    HELD_UP = "this computer was held up"
    LATE_THROUGHOUT = "this computer or its link was late throughout"
    LATE_SAMPLES = "too many readings came late"
    """Late samples in virtual time, where the link's replies are late, not the computer."""
    NO_BYTES = "the recording holds no bytes of the link"
    NO_LIMIT = "there is no limit for it"
    NO_MOTION = "its channel does not move"


class MissingReadingError(Exception):
    """A check returned no value for a declared metric, without an excuse. Always a bug in the check."""


@dataclass(frozen=True)
class Withheld:
    """Reading that was not judged, with its reason."""

    experiment: str
    metric: str
    subject: str
    words: str
    """Display name of the metric."""
    why: NotJudgedReason
    held_up_s: float = 0.0
    """Scheduling delay of this computer, s; 0 unless the reason is `NotJudgedReason.HELD_UP`."""

    @property
    def reason(self) -> str:
        """Reason as a phrase for sentences."""
        return self.why.value + (f" for {1e3 * self.held_up_s:.0f} ms" if self.why is NotJudgedReason.HELD_UP else "")

    @property
    def sentence(self) -> str:
        """Withheld reading as one sentence."""
        where = subject_words(self.subject)
        return f"{capital(where)}: {self.words} was not judged: {self.reason}"


@dataclass(frozen=True)
class Tally:
    """Counts of a run's checks: passed, failed, unmeasured, withheld."""

    passed: int
    failed: int
    withheld: int
    unmeasured: int = 0
    """Number of checks with an unmeasurable reading; neither passed nor failed."""

    @property
    def words(self) -> str:
        """Counts as one sentence without a full stop."""
        asked = self.passed + self.failed + self.unmeasured
        if self.failed:
            words = f"{self.failed} of {asked} checks failed"
        elif self.unmeasured:
            words = f"{self.passed} of {asked} checks passed"
        else:
            words = f"{asked} checks passed" if self.withheld else f"all {asked} checks passed"
        others = ((self.unmeasured, "not measurable"), (self.withheld, "not judged"))
        return ", ".join((words, *(f"{count} {what}" for count, what in others if count)))


def failed(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Return the findings that did not pass, unmeasurable ones included."""
    return tuple(finding for finding in findings if not finding.passed)
