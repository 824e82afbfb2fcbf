"""Result folder of a validation: recordings, checks, measured values, report."""

import dataclasses
from pathlib import Path

from aero.channels import Channel
from aero.whole_file import write_whole
from hil.recordings.output import json_text
from hil.report.measured import measured_csv
from hil.report.page import render_report
from hil.verdict import baseline
from hil.verdict.case_file import HandOfCase, StoredCase, write_case
from hil.verdict.judged_run import Validation


def write_figures(validation: Validation, out: Path) -> None:
    """Write `checks.json` and `measured.csv`.

    Raises:
        OSError: the folder cannot be written.
    """
    write_whole(out / "checks.json", json_text(checks_json(validation)))
    write_whole(out / "measured.csv", measured_csv(validation.judged))


def write_results(validation: Validation, out: Path) -> None:
    """Write the figures and the report into the folder of the run's recordings.

    Raises:
        OSError: the folder cannot be written.
    """
    write_figures(validation, out)
    names = [*validation.judged, *(cut.header.experiment for cut in validation.end.cut)]
    files = {name: f"{name}.mcap" for name in names if (out / f"{name}.mcap").exists()}
    write_whole(out / "report.html", render_report(validation, files))


def write_case_of(validation: Validation, out: Path, hand: HandOfCase | None = None) -> None:
    """Write the case that a run opens, if it does, into the run's folder.

    Args:
        validation: the run.
        out: the folder.
        hand: hand of the case; None takes what the recordings hold.

    Raises:
        OSError: the folder cannot be written.
    """
    if (case := validation.diagnosis.case) is not None and (header := validation.header) is not None:
        date = header.started[:16].replace("T", " ")
        write_case(out, StoredCase(case, hand or HandOfCase.of(header), date=date))


def checks_json(validation: Validation) -> dict[str, object]:
    """Return the content of `checks.json`: measured values, findings and diagnosis."""
    header = validation.header
    return {
        "hand": {} if header is None else baseline.described(header),
        "passed": validation.passed,
        "not_run": list(validation.left_out),
        "measured": {
            name: {subject: dict(row) for subject, row in measured.items()}
            for name, measured in validation.numbers.items()
        },
        "counts": dataclasses.asdict(validation.tally),
        "findings": [dataclasses.asdict(finding) for finding in validation.findings],
        "diagnosis": diagnosis_json(validation),
        "withheld": [dataclasses.asdict(withheld) | {"why": withheld.why.value} for withheld in validation.withheld],
    }


def diagnosis_json(validation: Validation) -> dict[str, object]:
    """Return suspects, evidence and next step; all empty for a passed run."""
    found = validation.diagnosis
    return {
        "suspects": [
            {"part": suspect.part.name.lower(), "channel": _label(suspect.channel)} for suspect in found.suspects
        ],
        "clues": list(found.clues),
        "evidence": [finding.sentence for finding in found.evidence],
        "unexplained": [finding.sentence for finding in found.unexplained],
        "step": None if found.step is None else dataclasses.asdict(found.step),
    }


def _label(channel: Channel | None) -> str | None:
    return None if channel is None else channel.label
