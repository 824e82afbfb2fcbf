"""A case as a file, `case.json` in the folder of the run that opened it, so that it can be put down and taken up."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, Self

from aero.channels import Channel
from aero.regular_file import read_json
from aero.whole_file import write_whole
from hil.checks import EXPERIMENTS
from hil.recordings.errors import NotOneHandError, UnusableFileError
from hil.recordings.output import json_text
from hil.recordings.recording import Header
from hil.targets.hand_spec import PHYSICAL
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
    hand_id: str = ""
    """Name of `hands.toml`, or serial number; empty where neither is known."""
    serial_number: str = ""
    """Of its USB port; empty where there is none."""
    unit: str = PHYSICAL
    """Unit of an emulated hand."""
    seed: int = 0
    faults: str = ""
    """Of an emulated hand, as `hil.faults.parse_fault` reads them, with blanks between."""

    @classmethod
    def of(cls, header: Header) -> Self:
        """Return the hand of a recording."""
        return cls(
            header.firmware, header.hand, header.hand_id, header.serial_number, header.unit, header.seed, header.faults
        )

    def require_same(self, said: Mapping[str, str]) -> None:
        """See that a hand is this one, by what is said of it: fields of this class, those that are known.

        A serial number decides over a name.

        Raises:
            NotOneHandError: it is another; the message says in what.
        """
        compared = ["firmware", "side", "serial_number"]
        if not (self.serial_number and said.get("serial_number")):
            compared.append("hand_id")
        for name in compared:
            then, now = getattr(self, name), said.get(name)
            if then and now and then != now:
                what = {"hand_id": "name"}.get(name, name.replace("_", " "))
                raise NotOneHandError(
                    f"the case is of another hand: {what} {then}, this is {now}; --same-hand where it is the same hand"
                )


HAND = tuple(one.name for one in fields(HandOfCase) if one.name != "seed")
"""Fields of a hand that are text."""


@dataclass(frozen=True)
class StoredCase:
    """What the file of a case holds."""

    case: DiagnosisCase
    hand: HandOfCase
    answers: Mapping[str, str] = field(default_factory=dict)
    """Answers to the questions of the present step, by question, that no run has followed yet."""


def write_case(folder: Path, stored: StoredCase) -> None:
    """Write a case into its folder.

    Raises:
        OSError: the folder cannot be written.
    """
    write_whole(folder / CASE, json_text(table_of(stored)))


def read_case(folder: Path) -> StoredCase:
    """Return the case of a folder.

    Raises:
        UnusableFileError: there is none, or it has a mistake; the message names it.
    """
    path = folder / CASE
    try:
        return case_of(read_json(path))
    except OSError as error:
        raise UnusableFileError(f"{folder} holds no case: {error.strerror or error}; `validate` opens one") from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise UnusableFileError(f"{path} is no case that this version reads ({type(error).__name__})") from error


def table_of(stored: StoredCase) -> dict[str, Any]:
    """Return a case as tables."""
    case = stored.case
    return {
        **asdict(stored.hand),
        "answers": dict(stored.answers),
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


def case_of(table: Any) -> StoredCase:
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
    hand = HandOfCase(**{name: str(table[name]) for name in HAND}, seed=int(table["seed"]))
    return StoredCase(case, hand, {str(asked): str(line) for asked, line in table["answers"].items()})


def _label(channel: Channel | None) -> str | None:
    return None if channel is None else channel.label


def _channel(label: str | None) -> Channel | None:
    return None if label is None else LABELS[label]
