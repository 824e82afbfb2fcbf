"""Where a finding can be seen, in which figure and seconds of which recording, and when a run first showed it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate

from hil.checks import JUDGED, Measuring
from hil.checks.shared.declaration import Metric
from hil.checks.shared.experiment import reading
from hil.checks.shared.signals import CommandStep, find_steps
from hil.checks.shared.subjects import CHANNELS
from hil.recordings.recording import Recording
from hil.verdict.findings import Finding, failed
from hil.verdict.judged_run import Result, Validation

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
    worst = reading(result.measured, finding.subject, metric.worst_at) if metric else None
    worst = None if worst is None or math.isnan(worst) else worst
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


@dataclass(frozen=True)
class FirstSeen:
    """The first finding of a run in time."""

    experiment: str
    seen_s: float
    """Since the hand was opened, s."""
    passed_until_s: float
    """End of the last experiment before it, s; all of those passed."""

    @property
    def sentence(self) -> str:
        """When, in words."""
        return f"from {self.seen_s:.0f} s after the start on, in {self.experiment}; every check before passed"


def first_seen(validation: Validation) -> FirstSeen | None:
    """Return when something was first seen, None when the first experiment that moves the hand shows it already."""
    whole, results = validation.whole_run, validation.results
    if whole is None:
        return None
    starts = start_times(whole.recording, [result.recording for result in results.values()])
    names = sorted(starts, key=lambda name: starts[name])
    bad = next((i for i, name in enumerate(names) if failed(results[name].findings)), None)
    if bad is None or not any(_moves(results[name].recording) for name in names[:bad]):
        return None
    name, before = names[bad], names[:bad]
    seen = [where.start for where in by_finding(validation.judged).values() if where.experiment == name]
    ended = starts[before[-1]] + results[before[-1]].recording.header.duration_s
    return FirstSeen(name, starts[name] + min(seen, default=0.0), ended)


def start_times(whole: Recording, parts: Sequence[Recording]) -> Mapping[str, float]:
    """Return when each experiment began, s since the hand was opened: where its bytes stand among those of the run.

    One whose bytes are not there is left out.
    """
    times, writes = _sent(whole)
    # One search through joined bytes: comparing lists of frames at every position took a second.
    joined = b"".join(writes)
    times_at = dict(zip(accumulate(map(len, writes), initial=0), times, strict=False))
    found: dict[str, float] = {}
    for part in parts:
        own_times, own = _sent(part)
        at = times_at.get(joined.find(b"".join(own))) if own else None
        if at is not None:
            found[part.header.experiment] = at - own_times[0]
    return found


def _sent(recording: Recording) -> tuple[list[float], list[bytes]]:
    sent = [record for record in recording.wire if record.direction == "to_hand"]
    return [record.t for record in sent], [record.data for record in sent]


def _moves(recording: Recording) -> bool:
    return "command_codes" in recording.series or "command" in recording.series
