"""Runs of one hand, read from the result folders of `aero-hil validate`, without a database."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

from aero.regular_file import read_json
from hil.checks import Measured
from hil.recordings.errors import UnusableFileError
from hil.recordings.mcap_file import read_header
from hil.recordings.recording import Header
from hil.verdict import baseline
from hil.verdict.case_file import CASE, read_case


class Intervention(NamedTuple):
    """Step of a case on the hand between two runs."""

    step: str
    """Name of the step in `steps.toml`."""
    channels: frozenset[str]
    """Labels of the affected channels; empty for the whole hand."""


@dataclass(frozen=True)
class HandRun:
    """One run of a hand."""

    folder: Path
    started: datetime
    """Start of the first recording."""
    header: Header
    """Header of the first recording."""
    measured: Mapping[str, Measured]
    passed: bool
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
    header = next(_headers(folder), None)
    if header is None:
        raise UnusableFileError("holds no recording, so that its date is not known")
    if not header.started:
        raise UnusableFileError("its recordings have no date")
    checks: Mapping[str, Any] = read_json(folder / "checks.json", baseline.LARGEST_BYTES)
    return HandRun(
        folder, datetime.fromisoformat(header.started), header, stored.measured, checks["passed"] is True, _done(folder)
    )


def _headers(folder: Path) -> Iterator[Header]:
    """Yield the headers of the folder's dated recordings in order of date."""
    headers = [read_header(path) for path in sorted(folder.glob("*.mcap"))]
    yield from sorted((one for one in headers if one.started), key=lambda one: datetime.fromisoformat(one.started))


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
