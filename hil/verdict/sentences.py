"""Failed findings as one sentence per channel: the strongest reading of each kind of evidence, without causes."""

from collections.abc import Iterable, Sequence
from operator import attrgetter

from aero.driver import CURRENT_A_PER_UNIT
from aero.printable import capital
from hil.checks.shared.declaration import EvidenceKind, MotionRole
from hil.checks.shared.subjects import subject_words
from hil.verdict.findings import Finding, NotJudgedReason, failed
from hil.verdict.judged_run import Validation

LENGTH = 155
"""Length limit of a sentence, characters (two terminal lines); further kinds of evidence are only in the report."""
NO_CURRENT = "draws no current"


def channel_sentences(run: Validation) -> tuple[str, ...]:
    """Return a sentence for each failed channel or the hand, suspected ones first, then by strength."""
    of: dict[str, list[Finding]] = {}
    for finding in failed(run.findings):
        if finding != run.end.finding:
            of.setdefault(finding.subject, []).append(finding)
    suspected = {channel.label for channel in run.diagnosis.channels}
    strongest = {subject: sorted(found, key=attrgetter("strength"), reverse=True) for subject, found in of.items()}
    order = sorted(of, key=lambda subject: (subject not in suspected, -strongest[subject][0].strength))
    still = {one.subject for one in run.withheld if one.why is NotJudgedReason.NO_MOTION}
    groups: dict[object, list[str]] = {}
    for subject in order:
        # Readings above and below their limits are two sentences, for one value stands for all subjects.
        kinds = {(_kind(finding), (finding.excess or 0.0) > 0) for finding in of[subject]}
        alike = (strongest[subject][0].check, *kinds) if len(kinds) == 1 else (subject,)
        groups.setdefault(alike, []).append(subject)
    return tuple(_sentence(alike, strongest[alike[0]], still=alike[0] in still) for alike in groups.values())


def _sentence(subjects: Sequence[str], findings: Sequence[Finding], *, still: bool) -> str:
    """Return the sentence of one subject, or of several that failed one check alone; the strongest is first."""
    words = subject_words(subjects[0])
    others = f" and {subject_words(subjects[1]) if len(subjects) == 2 else f'{len(subjects) - 1} more'}"
    others = others if len(subjects) > 1 else ""
    text = f"{capital(words)}{others}: "
    for number, clause in enumerate(_clauses(findings, still=still)):
        if number and len(text) + len(clause) > LENGTH:
            break
        joined = " and " if clause.startswith(NO_CURRENT) else "; "
        text += f"{joined if number else ''}{clause}"
    return f"{text}."


def _clauses(findings: Sequence[Finding], *, still: bool) -> Iterable[str]:
    """Yield a clause for each kind of evidence; a channel without motion gets one for its lack of motion."""
    moved = [one for one in findings if one.metric and one.metric.motion is MotionRole.MEASURED]
    told = set[EvidenceKind | str]()
    if moved and still:
        distances = {one.measured: _distance(one) for one in sorted(moved, key=_is_length)}
        yield f"does not move ({', '.join(distances.values())})"
        told.add(EvidenceKind.TRAVEL)
    for finding in findings:
        if (kind := _kind(finding)) in told:
            continue
        told.add(kind)
        if finding.excess is None:
            yield f"{finding.name} not measurable"
        elif kind is EvidenceKind.TORQUE and abs(_value(finding)) <= CURRENT_A_PER_UNIT:
            yield f"{NO_CURRENT} (0.00 A of {finding.expected})"
        else:
            yield f"{finding.name} {_without_unit(finding)}, should be {finding.expected}"


def _without_unit(finding: Finding) -> str:
    """Return the measured value, without its unit if the expectation ends with the same one."""
    value, _, unit = finding.measured.partition(" ")
    return value if unit and finding.expected.endswith(f" {unit}") else finding.measured


def _distance(finding: Finding) -> str:
    return f"{finding.measured} of {finding.expected}" if _is_length(finding) else finding.measured


def _is_length(finding: Finding) -> bool:
    return "%" not in finding.measured


def _value(finding: Finding) -> float:
    return float(finding.measured.split()[0])


def _kind(finding: Finding) -> EvidenceKind | str:
    metric = finding.metric
    return (metric and metric.evidence) or finding.check
