"""Self-contained HTML page of one run: verdict and location, first plot, evidence, then details."""

import json
import math
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from operator import attrgetter
from typing import Any
from urllib.parse import quote

import markupsafe
from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from markupsafe import Markup

from aero.channels import Channel
from hil.checks import EXPERIMENTS, JUDGED, WHOLE_RUN
from hil.checks.shared.declaration import number
from hil.checks.shared.experiment import Details
from hil.checks.shared.subjects import CHANNELS, SUBJECTS, subject_words
from hil.recordings.recording import Event, Recording
from hil.report.bands import banded
from hil.report.beside_paper import MARKED, compared, reasons, table, text_rows
from hil.report.evidence import Evidence, by_finding, first_plot, first_seen
from hil.report.finger_map import DIGITS, MARKS, verdicts
from hil.report.health import health_of
from hil.report.measured import MeasuredNumber, readings_of
from hil.report.plots import Plot, drawable, packed, whole, with_samples
from hil.verdict.case import DiagnosisCase
from hil.verdict.case_file import StoredCase
from hil.verdict.case_words import asked, conclusion, outcome_text, why
from hil.verdict.findings import Finding, NotJudgedReason, failed
from hil.verdict.group import CaseState
from hil.verdict.judged_run import Result, Validation
from hil.verdict.part import Part
from hil.verdict.parts import listed
from hil.verdict.run_end import EndKind
from hil.verdict.sentences import channel_sentences
from hil.verdict.steps import StepOutcome

BYTES_ALONE = (
    "These are the bytes of a program and a hand, without an experiment: the link is judged. What was meant is not in "
    "them, so the driver's order, scale and sign are not judged."
)
"""Remark on a recording by `emulate` or `proxy`."""
HEADINGS = {
    "pass": "\u2713 Within limits",
    "fail": "\u2717 Out of limits",
    "stopped": "\u25a0 Stopped by the guard",
    "aborted": "\u25a0 Aborted",
    "unclear": "\u2013 Not judged",
}
_OF_END = {
    EndKind.HOST_BUSY: "unclear",
    EndKind.FAULT_NEVER_FIRED: "unclear",
    EndKind.NOT_PERMITTED: "unclear",
    EndKind.STOPPED: "stopped",
    EndKind.NOT_OPENED: "stopped",
    EndKind.LINK: "aborted",
    EndKind.FIRMWARE: "aborted",
    EndKind.NOT_WRITTEN: "aborted",
    EndKind.INTERRUPTED: "aborted",
    EndKind.INCOMPLETE: "aborted",
}
"""Key of `HEADINGS` by the end of a run; after any other end the findings decide."""
CASE_HEADINGS = {
    "pass": "\u2713 The failure is gone",
    "fail": "\u2717 At fault",
    "setup": "\u2013 Nothing is broken",
    "unclear": "\u2013 Open case",
}
MOST_SENTENCES = 3
"""Number of failing channels or parts described in the head of the page."""
MOST_FINDINGS = 6
"""Number of findings shown before a list is folded."""


@dataclass(frozen=True)
class Section:
    """Section of the page on one experiment, or on the run as a whole."""

    name: str
    title: str
    result: Result
    failed: int
    plot: Plot | None
    details: Details | None

    @property
    def measured(self) -> list[MeasuredNumber]:
        """Measured values of the section on known subjects."""
        return [one for one in readings_of(self.name, self.result) if one.subject in SUBJECTS]


@dataclass(frozen=True)
class Shown:
    """Failed finding on the page."""

    anchor: str
    finding: Finding
    evidence: Evidence | None
    show: str
    """View that a link to the plot selects: channels, start and end, JSON."""


def render_report(validation: Validation, files: Mapping[str, str] | None = None) -> str:
    """Return the self-contained page of a run.

    Args:
        validation: judged run.
        files: name of an experiment, or `session`, to the path of its recording relative to the page, for links.

    Raises:
        ValueError: the run has no recording.
    """
    header, recordings = validation.header, _recordings(validation)
    if header is None:
        raise ValueError("no experiment began; there is nothing to report on")
    seen = by_finding(validation.judged)
    shown = {item.finding: item for item in _shown(validation, seen)}
    diagnosis = validation.diagnosis
    # The end of the run is omitted here, because the page shows it beside the verdict.
    said = [finding for finding in diagnosis.evidence if finding != validation.end.finding]
    speaking = sorted(said, key=attrgetter("strength"), reverse=True)
    return _template("report.html.j2").render(
        header=header,
        validation=validation,
        verdict=(verdict := verdict_of(validation)),
        heading=HEADINGS[verdict],
        place=diagnosis.place,
        tally=validation.tally,
        counts=counts(validation),
        digits=DIGITS,
        channels=(states := verdicts(validation)),
        marks=MARKS,
        reasons=sorted({verdict.reason for verdict in states.values() if verdict.reason}),
        first_finding={item.finding.subject: item.anchor for item in reversed(shown.values())},
        diagnosis=diagnosis,
        since=first_seen(validation),
        sentences=channel_sentences(validation)[:MOST_SENTENCES],
        health=health_of(validation),
        first=(first := first_plot(validation, seen)) and replace(first, plot=banded(first.plot, validation)),
        evidence=[shown[finding] for finding in speaking if finding in shown],
        others=[item for item in shown.values() if item.finding not in (*speaking, validation.end.finding)],
        most=MOST_FINDINGS,
        withheld=withheld_lines(validation),
        sections=_sections(validation),
        beside=_beside_paper(validation),
        text_rows=text_rows(validation),
        bytes_alone="" if validation.results or validation.end.cut else BYTES_ALONE,
        cut=[(one.header, whole(one, Channel)) for one in map(with_samples, validation.end.cut) if drawable(one)],
        exchanged=None if validation.results or validation.end.cut else _exchanged(recordings),
        events=_repeated(recordings.values()),
        files={name: quote(os.fsencode(path)) for name, path in (files or {}).items()},
        subjects=SUBJECTS,
        channel_titles=[channel.title for channel in Channel],
        readings=packed(recordings),
    )


def render_case(stored: StoredCase, validate_again: str = "") -> str:
    """Return the self-contained page of a case: conclusion, and the steps that led to it.

    Args:
        stored: content of the case file.
        validate_again: shell command that validates the hand of the case; empty if its port is unknown.
    """
    case = stored.case
    steps = [
        (
            outcome_text(one),
            f"step-{number}/report.html" if one.proposal.step.runs and {*one.outcomes} != {StepOutcome.SKIPPED} else "",
        )
        for number, one in enumerate(case.done, 1)
    ]
    proposal = case.next_step
    return _template("case.html.j2").render(
        verdict=(verdict := _verdict_of_case(case)),
        heading=CASE_HEADINGS[verdict] if verdict != "unclear" or proposal else "\u2013 Not isolated",
        conclusion=conclusion(case),
        suspects=_listed(case),
        before=_listed(replace(case, done=())),
        steps=steps,
        next="" if proposal is None else asked(proposal),
        why="" if proposal is None else why(case, proposal),
        stored=stored,
        validate_again="" if proposal else validate_again,
    )


def _listed(case: DiagnosisCase) -> str:
    return listed(map(str, case.remaining)) if case.remaining else "nobody"


def _verdict_of_case(case: DiagnosisCase) -> str:
    """Return the key of `CASE_HEADINGS` for a case; a corrected set-up counts as a pass."""
    told = case.told
    set_up = all(one.part is Part.SETUP for one in told)
    if case.state is CaseState.RESET or (case.gone and told and set_up):
        return "pass"
    if not told:
        return "unclear"
    return "setup" if set_up else "fail"


@cache
def _template(name: str) -> Template:
    environment = Environment(
        loader=PackageLoader("hil.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"marked": marked, "subject": subject_words, "number": reading_text}
    return environment.get_template(name)


def reading_text(value: float) -> str:
    """Return a reading as text, or `not measurable` for NaN."""
    return "not measurable" if math.isnan(value) else number(value)


def marked(text: str) -> Markup:
    """Return a text as escaped HTML, with spans between backticks as code."""
    parts = text.split("`")
    return Markup("").join(
        Markup("<code>{}</code>").format(part) if i % 2 else markupsafe.escape(part) for i, part in enumerate(parts)
    )


def counts(validation: Validation) -> str:
    """Return the counts of a run's checks; those of a run without a verdict do not claim that all passed."""
    words = validation.tally.words
    return words.removeprefix("all ") if verdict_of(validation) == "unclear" else words


def verdict_of(validation: Validation) -> str:
    """Return the key of `HEADINGS` for a run."""
    return _OF_END.get(validation.end.kind) or ("pass" if validation.passed else "fail")


def _recordings(validation: Validation) -> dict[str, Recording]:
    """Return the recordings of a run by experiment; for a wire recording, with series decoded from its bytes."""
    found = {name: result.recording for name, result in validation.results.items()}
    found |= {recording.header.experiment: with_samples(recording) for recording in validation.end.cut}
    if not found and validation.whole_run is not None:
        return {WHOLE_RUN.name: with_samples(validation.whole_run.recording)}
    return found


def _exchanged(recordings: Mapping[str, Recording]) -> Plot | None:
    recording = recordings.get(WHOLE_RUN.name)
    return whole(recording, Channel) if recording is not None and drawable(recording) else None


def _sections(validation: Validation) -> list[Section]:
    found = []
    for name, result in validation.judged.items():
        if not result.findings and name not in EXPERIMENTS:
            continue
        judged, bad = JUDGED[name], failed(result.findings)
        own = {CHANNELS.index(finding.subject) for finding in bad if finding.subject in CHANNELS}
        channels = [Channel(number) for number in sorted(own)] or Channel
        drawn = name in EXPERIMENTS and drawable(result.recording)
        plot = banded(whole(result.recording, channels), validation) if drawn else None
        details = judged.details(result.recording) if judged.details and result.measured else None
        found.append(Section(name, judged.title, result, len(bad), plot, details))
    return found


def _shown(validation: Validation, seen: Mapping[Finding, Evidence]) -> Iterable[Shown]:
    for count, finding in enumerate(failed(validation.findings), start=1):
        where, show = seen.get(finding), ""
        if where is not None:
            channels = [CHANNELS.index(finding.subject)] if finding.subject in CHANNELS else list(Channel)
            show = json.dumps({"channels": channels, "start": where.start, "end": where.end})
        yield Shown(f"finding-{count}", finding, where, show)


def withheld_lines(validation: Validation) -> dict[str, list[str]]:
    """Return lines on withheld checks by reason, the reason being that of the longest delay of a kind."""
    found: dict[NotJudgedReason, dict[str, list[str]]] = {}
    reasons: dict[NotJudgedReason, str] = {}
    for one in sorted(validation.withheld, key=lambda one: one.held_up_s):
        reasons[one.why] = one.reason
        subjects = found.setdefault(one.why, {}).setdefault(f"{one.words} ({one.experiment})", [])
        subjects.append(subject_words(one.subject))
    return {
        reasons[why]: [f"{words}: {', '.join(subjects)}" for words, subjects in of.items()] for why, of in found.items()
    }


def _repeated(recordings: Iterable[Recording]) -> list[tuple[str, str]]:
    """Return pairs of location and text of events; merge events that differ only in numbers."""
    found: dict[tuple[str, str, str], list[Event]] = {}
    for recording in recordings:
        for event in recording.events:
            key = recording.header.experiment, event.severity, re.sub(r"\d+(\.\d+)?", "#", event.text)
            found.setdefault(key, []).append(event)
    return [(f"{key[0]}, {_when(events)}", f"{key[1]}: {events[0].text}") for key, events in found.items()]


def _when(events: Sequence[Event]) -> str:
    first, last = events[0].t, events[-1].t
    return f"{first:.2f} s" if len(events) == 1 else f"{len(events)} times, {first:.1f} to {last:.1f} s"


def _beside_paper(validation: Validation) -> dict[str, Any] | None:
    """Return the comparison with the paper's table and known differences, or None if no value was measured."""
    result = compared(validation)
    return None if result is None else {"rows": table(result), "reasons": reasons(result), "marked": MARKED}
