"""Case file, `case.json` in the folder of the run that opened the case, to interrupt and resume a diagnosis."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, Self

from aero.channels import Channel
from aero.regular_file import read_json
from aero.whole_file import write_whole
from hil.checks import EXPERIMENTS
from hil.checks.shared.subjects import SUBJECTS
from hil.recordings.errors import NotOneHandError, UnusableFileError
from hil.recordings.output import json_text
from hil.recordings.recording import Header
from hil.targets.hand_spec import PHYSICAL
from hil.verdict.case import DiagnosisCase, Done
from hil.verdict.failures import EVIDENCE, LABELS, Failures
from hil.verdict.group import AmbiguityGroup, Proposal
from hil.verdict.limits import Key
from hil.verdict.part import Part
from hil.verdict.parts import Suspect
from hil.verdict.steps import StepOutcome, steps

CASE = "case.json"
STEP = "step-{}"
"""Folder of the rerun after a step of a case, by the step's number, in the folder of the case."""


@dataclass(frozen=True)
class HandOfCase:
    """Hand that a case is about."""

    firmware: str
    side: str
    hand_id: str = ""
    """Name in `hands.toml`, or serial number; empty if both are unknown."""
    serial_number: str = ""
    """Serial number of the USB port; empty without a USB port."""
    unit: str = PHYSICAL
    """Unit of an emulated hand; a file with its whole path."""
    firmware_program: str = ""
    """Program on the board of an emulated hand; empty for an emulated board."""
    zeros: str = "homed"
    """Encoder zeros of an emulated hand: `homed` or `ideal`."""
    baseline: str = ""
    """Folder with the baseline of the hand, with its whole path; empty without one."""
    seed: int = 0
    faults: str = ""
    """Faults of an emulated hand in the format of `hil.emulated.faults.parse_fault`, separated by blanks."""

    @classmethod
    def of(cls, header: Header) -> Self:
        """Return the hand of a recording."""
        return cls(
            header.firmware, header.side, header.hand_id, header.serial_number, header.unit, seed=header.seed,
            faults=header.faults,
        )  # fmt: skip

    @property
    def emulated(self) -> bool:
        """Whether the hand is an emulated one."""
        return self.unit != PHYSICAL

    @property
    def options(self) -> dict[str, str]:
        """Options of `aero-hil diagnose` for the hand's files, since no file is opened because a case names it."""
        unit = self.unit if self.unit.endswith(".toml") else ""
        files = {"--unit": unit, "--firmware-program": self.firmware_program, "--baseline": self.baseline}
        return {option: path for option, path in files.items() if path}

    def require_same(self, said: Mapping[str, str]) -> None:
        """Raise unless the fields `said` of a hand match this hand.

        A serial number decides over a name. A name on one side only is a difference, because the hand is not known.

        Raises:
            NotOneHandError: another hand, or an unknown one; the message names the field that differs.
        """
        by_number = bool(self.serial_number and said.get("serial_number"))
        for name in ("firmware", "side", "serial_number" if by_number else "hand_id"):
            then, now = getattr(self, name), said.get(name) or ""
            if then != now and (name == "hand_id" or (then and now)):
                what = {"hand_id": "name"}.get(name, name.replace("_", " "))
                raise NotOneHandError(
                    f"the case belongs to another hand: {what} {then or 'unknown'}, connected is {now or 'unknown'}. "
                    "If it is the same hand, add --same-hand"
                )


HAND = tuple(one.name for one in fields(HandOfCase) if one.name != "seed")
"""Fields of a hand that are text."""


@dataclass(frozen=True)
class StoredCase:
    """Content of a case file."""

    case: DiagnosisCase
    hand: HandOfCase
    answers: Mapping[str, str] = field(default_factory=dict)
    """Answers to the questions of the current step, by question, given before its rerun."""
    date: str = ""
    """Date and time of the run that opened the case, to the minute."""


def write_case(folder: Path, stored: StoredCase) -> None:
    """Write a case into its folder.

    Raises:
        OSError: the folder cannot be written.
    """
    write_whole(folder / CASE, json_text(table_of(stored)))


def read_case(folder: Path) -> StoredCase:
    """Return the case of a folder.

    Raises:
        UnusableFileError: the case file is missing or invalid.
    """
    path = folder / CASE
    try:
        return case_of(read_json(path))
    except FileNotFoundError as error:
        raise UnusableFileError(f"{folder} holds no case; `validate` opens one if a check fails") from error
    except OSError as error:
        raise UnusableFileError(f"{path} cannot be read: {error.strerror or error}") from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise UnusableFileError(f"{path} is not a case of this version ({type(error).__name__})") from error


def table_of(stored: StoredCase) -> dict[str, Any]:
    """Return a case as JSON-compatible tables."""
    case = stored.case
    return {
        **asdict(stored.hand),
        "answers": dict(stored.answers),
        "date": stored.date,
        "ran": list(case.ran),
        "planned": list(case.planned),
        "groups": [
            {
                "seen": one.seen,
                "failed": [[*key, excess] for key, excess in one.before.off.items()],
                "strong": _suspects_table(one.strong),
                "weak": _suspects_table(one.weak),
            }
            for one in case.opened
        ],
        "steps": [
            {
                "step": one.proposal.step.name,
                "at": _label(one.proposal.at),
                "beside": _label(one.proposal.beside),
                "outcomes": [outcome.name for outcome in one.outcomes],
                "note": one.note,
            }
            for one in case.done
        ],
    }


def case_of(table: Any) -> StoredCase:
    """Return the case of JSON-compatible tables.

    Raises:
        ValueError, KeyError, TypeError, AttributeError: a table without the form of `table_of`.
    """
    ran, planned = (tuple(table[key]) for key in ("ran", "planned"))
    if not {*ran, *planned} <= EXPERIMENTS.keys():
        raise ValueError(f"unknown experiments {ran} of {planned}")
    groups = tuple(map(_group, table["groups"]))
    case = DiagnosisCase(groups, ran, planned, tuple(_done(row, len(groups)) for row in table["steps"]))
    hand = HandOfCase(**{name: str(table[name]) for name in HAND}, seed=int(table["seed"]))
    answers = {str(asked): str(line) for asked, line in table["answers"].items()}
    return StoredCase(case, hand, answers, str(table["date"]))


def _key(experiment: str, metric: str, subject: str) -> Key:
    if (experiment, metric) not in EVIDENCE or subject not in SUBJECTS:
        raise ValueError(f"unknown reading {experiment}/{metric} of {subject}")
    return experiment, metric, subject


def _excess(value: float) -> float:
    if not math.isfinite(float(value)):
        raise ValueError(f"an excess is a number, not {value}")
    return float(value)


def _suspects(rows: Any) -> frozenset[Suspect]:
    return frozenset(Suspect(Part[part], _channel(on)) for part, on in rows)


def _suspects_table(suspects: frozenset[Suspect]) -> list[list[str | None]]:
    return sorted(([one.part.name, _label(one.channel)] for one in suspects), key=str)


def _group(row: Any) -> AmbiguityGroup:
    before = Failures({_key(e, m, on): _excess(excess) for e, m, on, excess in row["failed"]})
    return AmbiguityGroup(before, _suspects(row["strong"]), _suspects(row["weak"]), str(row["seen"]))


def _done(row: Any, groups: int) -> Done:
    proposal = Proposal(steps()[row["step"]], _channel(row["at"]), _channel(row["beside"]))
    outcomes = tuple(StepOutcome[name] for name in row["outcomes"])
    if not {*outcomes} <= {*proposal.step.outcomes} or proposal.step.of_one_channel != (proposal.at is not None):
        raise ValueError(f"step {row['step']} at {row['at']} has no outcome {row['outcomes']}")
    if len(outcomes) != groups:
        raise ValueError(f"{len(outcomes)} outcomes of step {row['step']} for {groups} groups")
    return Done(proposal, outcomes, str(row["note"]))


def _label(channel: Channel | None) -> str | None:
    return None if channel is None else channel.label


def _channel(label: str | None) -> Channel | None:
    return None if label is None else LABELS[label]
