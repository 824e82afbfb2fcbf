"""Where a finding can be seen: in which figure of the page, and in which seconds of which recording."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from hil.checks import JUDGED, Measuring
from hil.checks.shared.declaration import Metric
from hil.checks.shared.signals import CommandStep, find_steps
from hil.checks.shared.subjects import CHANNELS
from hil.recordings.recording import Recording
from hil.verdict.findings import Finding, failed
from hil.verdict.judged_run import Result

PANEL_OF_UNIT = {"A": "currents", "°C": "temperatures"}
"""Unit of a metric to the figure that shows it; `codes` for the others."""


@dataclass(frozen=True)
class Evidence:
    """The seconds of one recording that show one finding."""

    experiment: str
    figure: str
    """Name of the figure on the page; empty when there is none."""
    start: float
    """s since the start of the recording."""
    end: float
    worst: float | None = None
    """Instant of the worst sample, s; None when it is not one instant that counts."""

    @property
    def words(self) -> str:
        """The time for people."""
        worst = "" if self.worst is None else f", worst at {self.worst:.1f} s"
        return f"{self.start:.1f} to {self.end:.1f} s{worst}"


def figure_name(experiment: str, panel: str) -> str:
    """Return the name of a figure on the page."""
    return f"{experiment}-{panel}"


def evidence(experiment: str, finding: Finding, result: Result) -> Evidence | None:
    """Return where a finding of an experiment can be seen, None when its recording has no samples."""
    recording, measuring = result.recording, JUDGED[experiment]
    end = max((float(series.times[-1]) for series in recording.series.values() if series.times.size), default=0.0)
    if not end:
        return None
    try:
        metric = measuring.metric(finding.check, finding.subject)
    except KeyError:  # a finding about the experiment as a whole
        metric = None
    start, end = _seconds(recording, finding, measuring.seconds or (metric.seconds if metric else ""), end)
    worst = result.measured.get(finding.subject, {}).get(metric.worst_at) if metric else None
    return Evidence(experiment, figure_name(experiment, _panel(measuring, metric, finding)), start, end, worst)


def by_finding(judged: Mapping[str, Result]) -> dict[Finding, Evidence]:
    """Return where each failed finding can be seen; those that cannot be are left out."""
    found = {
        finding: evidence(name, finding, result)
        for name, result in judged.items()
        for finding in failed(result.findings)
    }
    return {finding: where for finding, where in found.items() if where is not None}


def _panel(measuring: Measuring, metric: Metric | None, finding: Finding) -> str:
    panel = (metric and (metric.shown_in or PANEL_OF_UNIT.get(metric.unit))) or "codes"
    own = finding.subject if finding.subject in CHANNELS else "codes"
    return own if "sweeps" in measuring.drawn and panel == "codes" else panel


def _seconds(recording: Recording, finding: Finding, which: str, end: float) -> tuple[float, float]:
    """Return the part of a recording that a finding is about."""
    # Lengths first: their codes change on the coupled channels of the thumb too.
    commands = recording.series.get("command", recording.series.get("command_codes"))
    if commands is None or finding.subject not in CHANNELS or which == "all":
        return 0.0, end
    steps = find_steps(commands.times, commands.values)
    if which == "last closing":
        closing = [step for step in steps if step.after > step.before]
        return (closing[-1].start, closing[-1].end) if closing else (0.0, end)
    return _own_steps(steps, CHANNELS.index(finding.subject)) or (0.0, end)


def _own_steps(steps: Iterable[CommandStep], channel: int) -> tuple[float, float] | None:
    """Return the first stretch in which only this channel is commanded, or its first step; None without a step."""
    stretch: list[CommandStep] = []
    for step in steps:
        if step.channel == channel:
            stretch.append(step)
        elif stretch:
            break
    return (stretch[0].start, stretch[-1].end) if stretch else None
