"""Evidence of findings: time range in a recording, worst instant, and the page's first plot."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aero.channels import FINGERS, Channel
from aero.printable import capital
from aero.safety import SafetyReason, SafetyStopError
from hil.checks import EXPERIMENTS, JUDGED
from hil.checks.shared.experiment import reading
from hil.checks.shared.signals import find_steps, own_stretch
from hil.checks.shared.subjects import CHANNELS, subject_words
from hil.recordings.recording import Recording
from hil.report.plots import ROWS, Plot, PlotColumn, drawable, duration_s, has_samples, with_samples
from hil.verdict.findings import Finding, failed
from hil.verdict.judged_run import Result, Validation

ROWS_OF_UNIT = {"°C": ("position", "temperature", "current")}
"""Unit of a metric, to the rows of the first plot; by default position, error and current."""
PADDING_S = 0.4
"""Padding before and after the time range of a finding, s."""
FULLY = 0.9
"""Threshold of travel, fraction of the window; above it an experiment closes a channel fully."""
LAST_S = 6.0
"""Length of the plot of an aborted experiment (its end), s."""
CLEARLY = 2.0
"""Threshold of excess; above it a finding counts as clear."""
ARRIVAL_S = 0.25
"""Settling time of a channel after a command, s; earlier errors are ignored, because every channel has them."""
SHORTEST_S = 0.1
"""Threshold of a channel's own stretch of commands, s; below it all channels count as commanded at once."""
LONGEST_S = 60.0
"""Limit of the plotted time range of a finding, s."""


@dataclass(frozen=True)
class Evidence:
    """Time range of a recording that shows a finding."""

    experiment: str
    start: float
    """Start of the range, s since the start of the recording."""
    end: float
    worst: float | None = None
    """Time of the worst sample, s; None for a metric without a single worst sample."""

    @property
    def words(self) -> str:
        """Time range for display."""
        worst = "" if self.worst is None else f", worst at {self.worst:.1f} s"
        return f"{self.start:.1f} to {self.end:.1f} s{worst}"


@dataclass(frozen=True)
class FirstPlot:
    """Most informative plot of a run."""

    title: str
    caption: str
    plot: Plot


def evidence(experiment: str, finding: Finding, result: Result) -> Evidence | None:
    """Return the evidence of a finding of an experiment, or None if the recording has no samples."""
    recording, measuring = result.recording, JUDGED[experiment]
    end = duration_s(recording)
    if not end:
        return None
    metric = finding.metric
    start, end = _seconds(recording, finding.subject, measuring.seconds or (metric.seconds if metric else ""), end)
    worst = reading(result.measured, finding.subject, metric.worst_at) if metric else None
    return Evidence(recording.header.experiment, start, end, None if worst is None or math.isnan(worst) else worst)


def by_finding(judged: Mapping[str, Result]) -> dict[Finding, Evidence]:
    """Return the evidence of each failed finding; omit findings without evidence."""
    found = {
        finding: evidence(name, finding, result)
        for name, result in judged.items()
        for finding in failed(result.findings)
    }
    return {finding: where for finding, where in found.items() if where is not None}


def first_plot(validation: Validation, seen: Mapping[Finding, Evidence]) -> FirstPlot | None:
    """Return a plot of a failed channel beside a healthy one, or of simulator and hand; None without samples."""
    if (cut := next(filter(drawable, map(with_samples, validation.end.cut)), None)) is not None:
        return _last_seconds(validation, cut)
    if seen:
        return _failed_beside_healthy(validation, seen)
    shown = [result.recording for result in validation.results.values() if drawable(result.recording)]
    return _agreement(max(shown, key=_agrees)) if shown else None


def _last_seconds(validation: Validation, cut: Recording) -> FirstPlot:
    name, end = cut.header.experiment, duration_s(cut)
    bad = _suspect(validation)
    channels = (bad, _companion(validation, bad))
    columns = (PlotColumn((one,), max(0.0, end - LAST_S), end, one.title, at=end) for one in channels)
    caption = f"The last {min(LAST_S, end):.0f} s of {name}, which did not run to its end."
    error = validation.end.error
    hot = isinstance(error, SafetyStopError) and error.reason is SafetyReason.TEMPERATURE
    rows = ROWS_OF_UNIT["°C"] if hot else ROWS[:3]
    return FirstPlot(_title(channels, ""), caption, Plot("first-plot", name, rows, tuple(columns)))


def _failed_beside_healthy(validation: Validation, seen: Mapping[Finding, Evidence]) -> FirstPlot:
    suspect = _suspect(validation)
    speaking = validation.diagnosis.evidence

    def rank(finding: Finding) -> tuple[bool, bool, bool]:
        # Prefer experiments to the whole run: a driver error is proven by the bytes, but visible in the motion.
        return finding.subject == suspect.label, finding.experiment in validation.results, finding in speaking

    best = max(map(rank, seen))
    found = [finding for finding in seen if rank(finding) == best]
    clear = min(CLEARLY, max(one.strength for one in found))

    def hard_to_see(finding: Finding) -> tuple[bool, bool, float, float]:
        # A short range in which the channel alone closes fully shows a finding best.
        experiment, where, metric = EXPERIMENTS.get(finding.experiment), seen[finding], finding.metric
        closes = experiment is not None and experiment.furthest[suspect] >= FULLY
        together = metric is not None and bool(metric.seconds)
        return not closes, together, where.end - where.start, -finding.strength

    finding = min((one for one in found if one.strength >= clear), key=hard_to_see)
    bad = Channel(CHANNELS.index(finding.subject)) if finding.subject in CHANNELS else suspect
    channels = (bad, healthy := _companion(validation, bad))
    result = validation.judged[finding.experiment]
    metric = finding.metric
    unit = metric.unit if metric else ""
    columns = []
    for channel in channels:
        where = evidence(finding.experiment, replace(finding, subject=channel.label), result) or seen[finding]
        end = min(where.end, where.start + LONGEST_S)
        worst = where.worst if channel is bad else None
        columns.append(
            PlotColumn(
                (channel,),
                max(0.0, where.start - PADDING_S),
                end + PADDING_S,
                channel.title,
                at=worst,
                zero=where.start,
            )
        )
    if columns[0].at is None and finding.subject in CHANNELS:
        columns[0] = replace(columns[0], at=_moment(result.recording, columns, unit))
    name = result.recording.header.experiment
    fine = finding.subject != "hand" and not any(f.subject == healthy.label for f in failed(validation.findings))
    marked = "This shows here" if columns[0].at is None else "The red line marks where this shows most"
    caption = f"{JUDGED[name].title}. Time counts from each channel's own command. {marked}: {finding.sentence}."
    title = _title(channels, ", which passed every check" if fine else "")
    rows = ROWS_OF_UNIT.get(unit, ROWS[:3])
    return FirstPlot(title, caption, Plot("first-plot", name, rows, tuple(columns), together=True))


def _agrees(recording: Recording) -> tuple[bool, bool]:
    """Return sort keys of a recording: has simulator and hand side by side; has a table in the paper."""
    return has_samples(recording, "model"), bool(EXPERIMENTS[recording.header.experiment].columns)


def _agreement(recording: Recording) -> FirstPlot:
    name = recording.header.experiment
    rows = ("length", "difference", "current") if has_samples(recording, "model") else ROWS[:3]
    columns = []
    for channel in (Channel.INDEX, Channel.THUMB_FLEXOR):
        start, end = _seconds(recording, channel.label, "", duration_s(recording))
        columns.append(PlotColumn((channel,), max(0.0, start - PADDING_S), end + PADDING_S, channel.title))
    title = "Command, simulator and hand" if "length" in rows else EXPERIMENTS[name].title
    return FirstPlot(title, "", Plot("first-plot", name, rows, tuple(columns)))


def _title(channels: Sequence[Channel], rest: str) -> str:
    bad, healthy = (subject_words(channel.label) for channel in channels)
    return f"{capital(bad)} beside the {healthy}{rest}"


def _suspect(validation: Validation) -> Channel:
    """Return the channel of the diagnosis, else of the stop, else with most failed checks."""
    channels, error = validation.diagnosis.channels, validation.end.error
    if channels:
        return channels[0]
    if isinstance(error, SafetyStopError) and error.channel is not None:
        return error.channel
    counts = [sum(f.subject == channel.label for f in failed(validation.findings)) for channel in Channel]
    return Channel(int(np.argmax(counts)))


def _companion(validation: Validation, bad: Channel) -> Channel:
    """Return a channel to compare with: preferably one that passed, of the same kind (finger or thumb), nearby."""
    off = {finding.subject for finding in failed(validation.findings)}
    others = [channel for channel in Channel if channel is not bad]
    return min(others, key=lambda c: (c.label in off, (c in FINGERS) != (bad in FINGERS), abs(c - bad)))


def _moment(recording: Recording, columns: Sequence[PlotColumn], unit: str) -> float | None:
    """Return the time, s, of the largest difference between the two columns' channels; None without samples.

    Compare currents, temperatures or position errors by `unit`, after the settling time of each command.
    """
    name = {"A": "currents", "°C": "temperatures"}.get(unit, "codes")
    if not has_samples(recording, name):
        return None
    times, values = recording[name].times, recording[name].values
    arrived = np.ones(len(times), bool)
    if has_samples(recording, "command_codes"):
        command = recording["command_codes"]
        rows = np.maximum(np.searchsorted(command.times, times, side="right") - 1, 0)
        changed = np.append(True, np.any(np.diff(command.values, axis=0) != 0, axis=1))
        since = times - np.maximum.accumulate(np.where(changed, command.times, 0.0))[rows]
        arrived = since > ARRIVAL_S
        values = command.values[rows] - values if name == "codes" else values
    bad, healthy = ((column.channels[0], column.start, column.end) for column in columns)
    inside = (times >= bad[1]) & (times <= bad[2])
    inside = inside & arrived if (inside & arrived).any() else inside
    if not inside.any():
        return None
    beside = np.interp(times[inside] - bad[1] + healthy[1], times, values[:, healthy[0]])
    return float(times[inside][np.argmax(np.abs(values[inside, bad[0]] - beside))])


def _seconds(recording: Recording, subject: str, which: str, end: float) -> tuple[float, float]:
    """Return start and end, s, of the part of a recording that a finding refers to."""
    # Commanded lengths instead of codes, because the map couples the codes of the thumb's channels.
    name = "command" if has_samples(recording, "command") else "command_codes"
    if not has_samples(recording, name) or subject not in CHANNELS or which == "all":
        return 0.0, end
    steps = find_steps(recording[name].times, recording[name].values)
    if which == "last closing":
        closing = [step for step in steps if step.after > step.before]
        return (closing[-1].start, closing[-1].end) if closing else (0.0, end)
    start, stop = own_stretch(steps, CHANNELS.index(subject)) or (0.0, end)
    return (start, stop) if stop - start >= SHORTEST_S else (0.0, end)


def first_seen(validation: Validation) -> str:
    """Return a phrase on the first failing experiment; empty if no experiment that moves the hand passed before."""
    ran = sorted(validation.results.values(), key=lambda result: result.recording.header.started)
    bad = next((i for i, result in enumerate(ran) if failed(result.findings)), None)
    if bad is None or not any(_moves(result.recording) for result in ran[:bad]):
        return ""
    before = sum(result.recording.header.duration_s for result in ran[:bad])
    name = ran[bad].recording.header.experiment
    return f"in {name}, after {before:.0f} s of experiments whose checks all passed"


def _moves(recording: Recording) -> bool:
    return "command_codes" in recording.series or "command" in recording.series
