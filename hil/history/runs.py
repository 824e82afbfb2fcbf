"""Runs of one hand, read from the result folders of `aero-hil validate`, without a database."""

from __future__ import annotations

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
from hil.verdict.case_file import CASE, read_case


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
            if folder in found:
                continue
            try:
                found[folder] = _run(folder)
            except (OSError, UnusableFileError, ValueError) as error:
                refused.append(Refused(folder, str(error)))
    return sorted(found.values(), key=lambda run: run.started), refused


def of_hand(runs: Iterable[HandRun], hand: str) -> list[HandRun]:
    """Return the runs of a hand by its name in `hands.toml` or its serial number.

    A name also selects earlier runs with the serial number alone, from before the hand was named.
    """
    every = list(runs)
    numbers = {run.header.serial_number for run in every if run.header.hand_id == hand} - {""}
    return [
        run
        for run in every
        if hand in (run.header.hand_id, run.header.serial_number) or run.header.serial_number in numbers
    ]


def names_in(runs: Iterable[HandRun]) -> list[str]:
    """Return the names or serial numbers of the hands that have runs."""
    return sorted({run.header.hand_id or run.header.serial_number for run in runs} - {""})


def _run(folder: Path) -> HandRun:
    stored = baseline.load(folder)
    header = _header(folder)
    if header is None:
        raise UnusableFileError("holds no recording, so that its date is not known")
    if not header.started:
        raise UnusableFileError("its recordings have no date")
    checks: Mapping[str, Any] = read_json(folder / "checks.json", baseline.LARGEST_BYTES)
    failed = RunVerdict.OUT if checks["counts"]["failed"] else RunVerdict.NOT_JUDGED
    verdict = RunVerdict.WITHIN if checks["passed"] is True else failed
    return HandRun(folder, datetime.fromisoformat(header.started), header, stored.measured, verdict, _done(folder))


def _header(folder: Path) -> Header | None:
    """Return the header of one dated recording; those of one run differ by minutes. None without a recording."""
    header = None
    for path in sorted(folder.glob("*.mcap")):
        header = read_header(path)
        if header.started:
            break
    return header


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
