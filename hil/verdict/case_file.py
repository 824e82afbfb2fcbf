"""A case as a file, `case.json` in the folder of the run that opened it, so that it can be put down and taken up."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from aero.channels import Channel
from aero.whole_file import write_whole
from hil.checks import EXPERIMENTS
from hil.recordings.errors import UnusableFileError
from hil.recordings.output import json_text
from hil.verdict.case import DiagnosisCase, Done, Proposal
from hil.verdict.failures import LABELS, Failures
from hil.verdict.parts import Part, Suspect
from hil.verdict.steps import StepOutcome, steps

CASE = "case.json"


@dataclass(frozen=True)
class HandOfCase:
    """The hand that a case is about."""

    firmware: str
    side: str


def write_case(folder: Path, case: DiagnosisCase, hand: HandOfCase) -> None:
    """Write a case into its folder.

    Raises:
        OSError: the folder cannot be written.
    """
    write_whole(folder / CASE, json_text(table_of(case, hand)))


def read_case(folder: Path) -> tuple[DiagnosisCase, HandOfCase]:
    """Return the case of a folder, and its hand.

    Raises:
        UnusableFileError: there is none, or it has a mistake; the message names it.
    """
    path = folder / CASE
    try:
        return case_of(json.loads(path.read_text(encoding="utf-8")))
    except OSError as error:
        raise UnusableFileError(f"{folder} holds no case: {error.strerror or error}; `validate` opens one") from error
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise UnusableFileError(f"{path} is no case that this version reads ({type(error).__name__})") from error


def table_of(case: DiagnosisCase, hand: HandOfCase) -> dict[str, Any]:
    """Return a case as tables."""
    return {
        "firmware": hand.firmware,
        "side": hand.side,
        "experiments": list(case.experiments),
        "ran": list(case.ran),
        "failed": [[*key, excess] for key, excess in case.before.off.items()],
        "suspects": [[one.part.name, _label(one.channel), likely] for one, likely in case.suspects.items()],
        "steps": [
            {
                "step": one.proposal.step.name,
                "at": _label(one.proposal.at),
                "beside": _label(one.proposal.beside),
                "outcome": one.outcome.name,
                "note": one.note,
            }
            for one in case.done
        ],
    }


def case_of(table: Any) -> tuple[DiagnosisCase, HandOfCase]:
    """Make a case of tables.

    Raises:
        ValueError, KeyError, TypeError, AttributeError: a table is not as `table_of` makes it.
    """
    experiments, ran = tuple(table["experiments"]), tuple(table["ran"])
    if not {*experiments, *ran} <= EXPERIMENTS.keys():
        raise ValueError(f"unknown experiments {experiments} of {ran}")
    case = DiagnosisCase(
        Failures({(str(e), str(m), str(on)): float(excess) for e, m, on, excess in table["failed"]}),
        {Suspect(Part[part], _channel(on)): float(likely) for part, on, likely in table["suspects"]},
        experiments,
        ran,
        tuple(
            Done(
                Proposal(steps()[row["step"]], _channel(row["at"]), _channel(row["beside"])),
                StepOutcome[row["outcome"]],
                str(row["note"]),
            )
            for row in table["steps"]
        ),
    )
    return case, HandOfCase(str(table["firmware"]), str(table["side"]))


def _label(channel: Channel | None) -> str | None:
    return None if channel is None else channel.label


def _channel(label: str | None) -> Channel | None:
    return None if label is None else LABELS[label]
