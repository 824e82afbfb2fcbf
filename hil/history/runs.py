"""Runs of one hand, read from the result folders of `aero-hil validate`, without a database."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import datetime
from enum import Enum
from pathlib import Path
from typing import Any, NamedTuple

from aero.regular_file import read_json
from hil.checks import Measured
from hil.recordings.errors import UnusableFileError
from hil.recordings.mcap_file import read_header
from hil.recordings.recording import Header
from hil.verdict import baseline
from hil.verdict.case_file import CASE, STEP, read_case


class RunVerdict(Enum):
    """RunVerdict of a run; values are texts for the page."""

    WITHIN = "within limits"
    OUT = "out of limits"
    NOT_JUDGED = "not judged"


class Intervention(NamedTuple):
    """Step of a case on the hand between two runs."""

    step: str
    """Name of the step in `steps.toml`."""
    channels: frozenset[str]
    """Labels of the affected channels; empty for the whole hand."""

    def concerns(self, subject: str) -> bool:
        """Return whether the step may change readings of a subject."""
        return not self.channels or subject in self.channels


@dataclass(frozen=True)
class HandRun:
    """One run of a hand."""

    folder: Path
    started: datetime
    """Start of one recording."""
    header: Header
    """Header of that recording."""
    measured: Mapping[str, Measured]
    verdict: RunVerdict
    interventions: tuple[Intervention, ...] = ()
    """Steps after this run, in the case that it opened."""


class Refused(NamedTuple):
    """Unusable result folder, with the reason."""

    folder: Path
    reason: str


def runs_in(places: Iterable[Path]) -> tuple[list[HandRun], list[Refused]]:
    """Return all runs below some folders in order of date, and the unusable folders."""
    found: dict[Path, HandRun] = {}
    refused: list[Refused] = []
    for place in places:
        for checks in sorted(place.rglob("checks.json")):
            folder = checks.parent.resolve()  # `latest` is a link to one of the others
            if folder in found or _is_rerun(folder):
                continue
            try:
                found[folder] = _run(folder)
            except (OSError, UnusableFileError, ValueError) as error:
                refused.append(Refused(folder, str(error)))
    # A copy, such as a baseline, is no other run.
    distinct = {(run.header.host, run.header.hand_id, run.started): run for run in found.values()}
    return sorted(distinct.values(), key=lambda run: run.started), refused


def _is_rerun(folder: Path) -> bool:
    """Return whether a folder is that of a rerun after a step of a case."""
    return re.fullmatch(STEP.format("[0-9]+"), folder.name) is not None and (folder.parent / CASE).exists()


def of_hand(runs: Iterable[HandRun], hand: str) -> tuple[list[HandRun], list[Refused]]:
    """Return the runs of a hand by its name in `hands.toml` or its serial number, and the doubtful ones.

    A name also selects runs with the serial number alone, from before the hand was named. Doubtful are those if the
    number is also of another name, and runs of the other side than the latest run's.

    Raises:
        UnusableFileError: the serial number is of several names.
    """
    every = list(runs)
    names = {(run.header.serial_number, _name(run)) for run in every}
    mine = [run for run in every if hand and hand == _name(run)]
    if mine:
        numbers = {run.header.serial_number for run in mine} - {""}
        unnamed = [run for run in every if run.header.serial_number in numbers and not _name(run)]
        others = {number for number, name in names if name not in ("", hand)}
    else:
        unnamed, others = [run for run in every if hand and run.header.serial_number == hand], set[str]()
        if len(several := sorted({_name(run) for run in unnamed} - {""})) > 1:
            raise UnusableFileError(f"the serial number {hand} is of {', '.join(several)}; name one of them")
    chosen = [*mine, *(run for run in unnamed if run.header.serial_number not in others)]
    chosen.sort(key=lambda run: run.started)
    doubtful = [
        Refused(run.folder, "its serial number is of several names")
        for run in unnamed
        if run.header.serial_number in others
    ]
    wrong = [run for run in chosen if run.header.side != chosen[-1].header.side]
    doubtful += [Refused(run.folder, f"of a {run.header.side} hand, unlike the latest run") for run in wrong]
    return [run for run in chosen if run not in wrong], doubtful


def _name(run: HandRun) -> str:
    """Return the name of a run's hand; empty if it had none."""
    return "" if run.header.hand_id == run.header.serial_number else run.header.hand_id


def names_in(runs: Iterable[HandRun]) -> list[str]:
    """Return the names or serial numbers of the hands that have runs."""
    return sorted({run.header.hand_id or run.header.serial_number for run in runs} - {""})


def _run(folder: Path) -> HandRun:
    stored = baseline.load(folder)
    header = _header(folder)
    if header is None:
        raise UnusableFileError("its date is unknown, because it holds no recording")
    checks: Mapping[str, Any] = read_json(folder / "checks.json", baseline.LARGEST_BYTES)
    counts = checks.get("counts")
    failed = isinstance(counts, Mapping) and bool(counts.get("failed"))
    verdict = RunVerdict.WITHIN if checks.get("passed") is True else RunVerdict.OUT if failed else RunVerdict.NOT_JUDGED
    return HandRun(folder, _date(header), header, stored.measured, verdict, _done(folder))


def _header(folder: Path) -> Header | None:
    """Return the header of one dated recording; those of one run differ by minutes. None without a recording."""
    header = None
    for path in sorted(folder.glob("*.mcap")):
        header = read_header(path)
        if header.started:
            break
    return header


def _date(header: Header) -> datetime:
    """Return the date of a recording.

    Raises:
        ValueError: not a date with a time zone.
    """
    date = datetime.fromisoformat(header.started)
    if date.tzinfo is None:
        raise ValueError(f"the date {header.started} of a recording has no time zone")
    return date


def _done(folder: Path) -> tuple[Intervention, ...]:
    if not (folder / CASE).is_file():
        return ()
    return tuple(
        Intervention(
            done.proposal.step.name,
            frozenset(at.label for at in (done.proposal.at, done.proposal.beside) if at is not None),
        )
        for done in read_case(folder).case.done
    )
