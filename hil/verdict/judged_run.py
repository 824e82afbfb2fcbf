"""A judged run of experiments: what was recorded and measured, what was found, how it ended, and what that means."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from hil.checks import ALIKE, DRIVER, EXPERIMENTS, WHOLE_RUN, Measured
from hil.recordings.recording import Header, Recording
from hil.verdict.diagnosis import NOTHING, Diagnosis
from hil.verdict.findings import Finding, Tally, Withheld, failed
from hil.verdict.run_end import RunEnd


@dataclass(frozen=True)
class Result:
    """One experiment that ran to its end."""

    recording: Recording
    measured: Measured
    findings: tuple[Finding, ...]
    withheld: tuple[Withheld, ...] = ()
    """Readings that were not judged."""


@dataclass(frozen=True)
class Validation:
    """A judged run of experiments."""

    results: Mapping[str, Result]
    """By experiment, in the order in which they ran."""
    end: RunEnd
    wall_seconds: float
    """Time from the start to the verdict, s."""
    regressions: tuple[Finding, ...] = ()
    """Comparison with the hand's own baseline, when there is one."""
    session: Recording | None = None
    """Every byte since the hand was opened, for an exact replay; None when judged from files."""
    whole_run: Result | None = None
    """What the bytes of the session say about the link; None when judged without them."""
    driver: Result | None = None
    """What the bytes of the experiments say about driver and map; None where no experiment ended."""
    alike: Result | None = None
    """What the readings of the channels say beside each other; None where nothing compares them."""
    diagnosis: Diagnosis = NOTHING
    """Where something is wrong, and what; empty for a run without failures."""
    planned: tuple[str, ...] = ()
    """Experiments that the run was to do; empty when judged from files."""
    left_out: tuple[str, ...] = ()
    """Experiments that the guard permits no hand with this firmware; the verdict is on the others."""

    @property
    def numbers(self) -> Mapping[str, Measured]:
        """What was measured: by experiment that could be measured, and `session` and `driver`."""
        return {name: result.measured for name, result in self.judged.items() if result.measured}

    @property
    def judged(self) -> Mapping[str, Result]:
        """Every experiment that ended; `session`, the whole run; `driver`, the bytes of all experiments."""
        whole = {WHOLE_RUN.name: self.whole_run, DRIVER.name: self.driver, ALIKE.name: self.alike}
        return {**self.results, **{name: result for name, result in whole.items() if result is not None}}

    def measured(self, name: str) -> Result | None:
        """Return an experiment's result, None when it did not run or could not be measured."""
        result = self.results.get(name)
        return result if result is not None and result.measured else None

    @property
    def header(self) -> Header | None:
        """The header of the first recording, None when nothing was recorded."""
        recordings = [*(result.recording for result in self.results.values()), *self.end.cut]
        recordings += [self.whole_run.recording] if self.whole_run else []
        return recordings[0].header if recordings else None

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Every finding, and the reason for stopping if there is one."""
        found = tuple(finding for result in self.judged.values() for finding in result.findings) + self.regressions
        return found if self.end.finding is None else (self.end.finding, *found)

    @property
    def tally(self) -> Tally:
        """The number of checks; how the run ended is none."""
        checks = [finding for finding in self.findings if finding != self.end.finding]
        bad = failed(checks)
        unmeasured = sum(finding.excess is None for finding in bad)
        return Tally(len(checks) - len(bad), len(bad) - unmeasured, len(self.withheld), unmeasured)

    @property
    def withheld(self) -> tuple[Withheld, ...]:
        """Every reading that was not judged."""
        return tuple(withheld for result in self.judged.values() for withheld in result.withheld)

    @property
    def answers(self) -> tuple[Finding, ...]:
        """Findings that a person's answers make."""
        return tuple(f for name, result in self.results.items() if EXPERIMENTS[name].asks for f in result.findings)

    @property
    def remark(self) -> str:
        """What was left out and why, one sentence; empty when nothing was."""
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
        """Whether every check of what was judged passed, whatever kept the rest from it."""
        return not failed((*(f for result in self.judged.values() for f in result.findings), *self.regressions))

    @property
    def hand_seconds(self) -> float:
        """Hand time of all recordings, s."""
        if not self.results and self.whole_run is not None:
            return self.whole_run.recording.header.duration_s
        return sum(float(result.recording["codes"].times[-1]) for result in self.results.values())
