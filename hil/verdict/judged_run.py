"""Judged run of experiments: recordings, readings, findings, ending, diagnosis."""

from collections.abc import Mapping
from dataclasses import dataclass

from hil.checks import ALIKE, DRIVER, EXPERIMENTS, WHOLE_RUN, Measured
from hil.recordings.recording import Header, Recording
from hil.verdict.diagnosis import NOTHING, Diagnosis
from hil.verdict.findings import Finding, Tally, Withheld, failed
from hil.verdict.run_end import RunEnd


@dataclass(frozen=True)
class Result:
    """Judged experiment that ran to its end."""

    recording: Recording
    measured: Measured
    findings: tuple[Finding, ...]
    withheld: tuple[Withheld, ...] = ()


@dataclass(frozen=True)
class Validation:
    """Judged run of experiments."""

    results: Mapping[str, Result]
    end: RunEnd
    wall_seconds: float
    """Time from the start to the verdict, s."""
    regressions: tuple[Finding, ...] = ()
    """Comparison with the hand's baseline, if there is one."""
    session: Recording | None = None
    """Recording of all bytes since opening, for an exact replay; None when judged from files."""
    whole_run: Result | None = None
    """Judged bytes of the session; None when judged without a session."""
    driver: Result | None = None
    """Judged bytes of driver and map; None if no experiment ended."""
    alike: Result | None = None
    """Comparison of channels; None if no reading compares them."""
    diagnosis: Diagnosis = NOTHING
    """Diagnosis of the failures; empty without failures."""
    planned: tuple[str, ...] = ()
    """Planned experiments; empty when judged from files."""
    left_out: tuple[str, ...] = ()
    """Experiments that the guard refuses with this firmware; the verdict excludes them."""

    @property
    def numbers(self) -> Mapping[str, Measured]:
        """Readings by experiment, plus those of the whole run."""
        return {name: result.measured for name, result in self.judged.items() if result.measured}

    @property
    def judged(self) -> Mapping[str, Result]:
        """Results by experiment, plus `session` (bytes of the run), `driver` and the comparison of channels."""
        whole = {WHOLE_RUN.name: self.whole_run, DRIVER.name: self.driver, ALIKE.name: self.alike}
        return {**self.results, **{name: result for name, result in whole.items() if result is not None}}

    def measured(self, name: str) -> Result | None:
        """Return an experiment's result, or None if it did not run or could not be measured."""
        result = self.results.get(name)
        return result if result is not None and result.measured else None

    @property
    def header(self) -> Header | None:
        """Header of the first recording, or None without any recording."""
        recordings = [*(result.recording for result in self.results.values()), *self.end.cut]
        recordings += [self.whole_run.recording] if self.whole_run else []
        return recordings[0].header if recordings else None

    @property
    def findings(self) -> tuple[Finding, ...]:
        """All findings, starting with the end of the run if it was cut short."""
        found = tuple(finding for result in self.judged.values() for finding in result.findings) + self.regressions
        return found if self.end.finding is None else (self.end.finding, *found)

    @property
    def tally(self) -> Tally:
        """Number of checks, without the finding about the end of the run."""
        checks = [finding for finding in self.findings if finding != self.end.finding]
        bad = failed(checks)
        unmeasured = sum(finding.excess is None for finding in bad)
        return Tally(len(checks) - len(bad), len(bad) - unmeasured, len(self.withheld), unmeasured)

    @property
    def withheld(self) -> tuple[Withheld, ...]:
        """All readings that were not judged."""
        return tuple(withheld for result in self.judged.values() for withheld in result.withheld)

    @property
    def answers(self) -> tuple[Finding, ...]:
        """Findings from a person's answers."""
        return tuple(f for name, result in self.results.items() if EXPERIMENTS[name].asks for f in result.findings)

    @property
    def remark(self) -> str:
        """Sentence about the left-out experiments; empty if there are none."""
        if not self.left_out:
            return ""
        return (
            f"Not run, and not judged: {', '.join(self.left_out)}. They push at stops, and this firmware has no torque "
            "limit, so the guard would stop the hand for its current."
        )

    @property
    def passed(self) -> bool:
        """Whether every check passed."""
        return not failed(self.findings)

    @property
    def judged_passed(self) -> bool:
        """Whether all judged checks passed, regardless of why the others were not run."""
        return not failed((*(f for result in self.judged.values() for f in result.findings), *self.regressions))

    @property
    def hand_seconds(self) -> float:
        """Hand time of all recordings, s."""
        if not self.results and self.whole_run is not None:
            return self.whole_run.recording.header.duration_s
        return sum(float(result.recording["codes"].times[-1]) for result in self.results.values())
