"""Run of a campaign: one emulated hand, healthy or faulty, through the experiments to its numbers."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import cycle, islice, product
from typing import Any, Self, get_args

import numpy as np

from aero.errors import AeroError
from aero.firmware import DEFAULT_FIRMWARE
from aero.safety import SafetyStopError
from aero.side import Side
from hil.checks import DEFAULT
from hil.emulated.any_hand import open_target
from hil.emulated.faults import parse_fault
from hil.emulated.faults.board import RUNS
from hil.recordings.provenance import source_commit
from hil.targets.hand_errors import FaultNeverFiredError
from hil.verdict.findings import failed
from hil.verdict.judged_run import Validation
from hil.verdict.parts import Suspect
from hil.verdict.run_end import FINISHED, EndKind
from hil.verdict.validation import validate
from model.units.conditions import CONDITIONS, drawn
from model.units.plausible import PLAUSIBLE


@dataclass(frozen=True, order=True)
class Trial:
    """Definition of a run: all inputs that its numbers depend on."""

    unit: str
    """Unit name for `open_target`, mostly `plausible:SEED`."""
    side: Side = "right"
    firmware: str = DEFAULT_FIRMWARE
    """Declared version; also the board's, unless a fault installs another."""
    seed: int = 0
    homed: bool = True
    guarded: bool = False
    """Whether the driver guards the hand, as for physical hands; a guarded hand is weaker at its stops."""
    faults: tuple[str, ...] = ()
    """Fault texts in the format of `hil.emulated.faults`; empty for a healthy hand."""
    experiments: tuple[str, ...] = DEFAULT
    conditions: tuple[str, ...] = ()
    """Kinds of (healthy) initial conditions, drawn from `seed`."""

    @classmethod
    def of(cls, table: Mapping[str, Any]) -> Self:
        """Return the trial of a table that `dataclasses.asdict` and JSON produced."""
        lists = {name: tuple(value) for name, value in table.items() if isinstance(value, list)}
        return cls(**{**table, **lists})

    @property
    def key(self) -> str:
        """Return the identifying text of the trial; equal keys mean equal trials."""
        zeros = ("homed" if self.homed else "ideal") + (", guarded" if self.guarded else "")
        found = [f"under {' + '.join(self.conditions)}"] if self.conditions else []
        parts = (self.unit, self.side, self.firmware, f"seed {self.seed}", zeros, *found)
        return " | ".join((*parts, " + ".join(self.faults) or "healthy", ",".join(self.experiments)))


@dataclass(frozen=True)
class Outcome:
    """Result of a trial."""

    trial: Trial
    numbers: Mapping[str, Mapping[str, Mapping[str, float]]]
    """Numbers by experiment, subject and metric, for every completed experiment."""
    failed: tuple[str, ...]
    """Failed checks, `experiment/metric/subject`."""
    stopped: str
    """Reason the run was cut short; empty if it completed."""
    ended: str
    """Name of the error that ended the run, or ""."""
    wall_s: float
    hand_s: float
    """Total duration of the recordings on the hand's clock, s."""
    commit: str = ""
    suspects: tuple[str, ...] = ()
    """Leading suspects of the diagnosis, `PART` or `PART/channel`; empty for a healthy result."""


def perform(trial: Trial) -> Outcome:
    """Run a trial on the virtual clock.

    Raises:
        ValueError: the trial names something that does not exist.
    """
    began = time.perf_counter()
    done, stopped, ended = Validation({}, FINISHED, 0.0), "", ""
    opening = open_target(
        firmware=trial.firmware,
        side=trial.side,
        unit=trial.unit,
        seed=trial.seed,
        homed=trial.homed,
        guarded=trial.guarded,
        faults=[parse_fault(text) for text in trial.faults],
        conditions=drawn(trial.seed, trial.conditions) if trial.conditions else None,
    )

    try:
        with opening as target:
            done = validate(target, trial.experiments)
            said = done.end.finding if done.end.kind is not EndKind.HOST_BUSY else None
            stopped = "" if said is None else f"{said.sentence}. {done.end.reason}".strip()
            ended = done.end.error_name
    except (FaultNeverFiredError, SafetyStopError) as error:
        stopped, ended = stopped or str(error), ended or type(error).__name__
    except (AeroError, OSError) as error:
        stopped, ended = f"the hand does not answer: {error}", type(error).__name__
    return Outcome(
        trial,
        done.numbers,
        tuple(
            f"{name}/{finding.check}/{finding.subject}"
            for name, result in done.judged.items()
            for finding in failed(result.findings)
        ),
        stopped,
        ended,
        time.perf_counter() - began,
        done.hand_seconds,
        source_commit(),
        tuple(map(written, done.diagnosis.suspects)),
    )


def written(suspect: Suspect) -> str:
    """Return a suspect in the format of an outcome: `PART` or `PART/channel`."""
    return suspect.part.name if suspect.channel is None else f"{suspect.part.name}/{suspect.channel.label}"


SIDES: tuple[Side, ...] = get_args(Side)
USUAL_FIRMWARE = (DEFAULT_FIRMWARE, "0.1.5")
"""Usual firmware: the newest version, and the newest without shifted windows."""


def healthy_hands(
    first: int,
    count: int,
    firmware: Sequence[str] = USUAL_FIRMWARE,
    conditions: Sequence[str] | None = None,
    *,
    sides: Sequence[Side] = SIDES,
) -> list[Trial]:
    """Return trials of healthy hands with seeds counted up from `first`; multiple kinds alternate.

    Args:
        first: first seed.
        count: number of hands.
        firmware: firmware versions, in turn.
        conditions: kinds of initial condition of all hands; None for all kinds on half of the hands.
        sides: sides, in turn; the side alternates fastest.
    """
    under = ((), CONDITIONS) if conditions is None else (tuple(conditions),)
    kinds = islice(cycle(product(under, (False, True), firmware, sides)), count)
    return [
        Trial(f"{PLAUSIBLE}{first + i}", side, version, first + i, guarded=guarded, conditions=found)
        for i, (found, guarded, version, side) in enumerate(kinds)
    ]


def faulty_hands(
    faults: Sequence[str], first: int, hands: int, firmware: Sequence[str] = USUAL_FIRMWARE
) -> list[Trial]:
    """Return a trial of each fault on each of `hands` fresh hands, with seeds counted up from `first`.

    A text with several faults, separated by commas, injects all of them into one hand. The hands are unguarded, because
    a guard would end a run early, and have no initial conditions.
    """
    every = healthy_hands(first, hands * len(faults), firmware, ())
    return [
        replace(hand, faults=tuple(fault.split(",")), guarded=False, firmware=_other(hand.firmware, fault, firmware))
        for fault, hand in zip(np.repeat(faults, hands).tolist(), every, strict=True)
    ]


def _other(declared: str, fault: str, firmware: Sequence[str]) -> str:
    """Return a version to declare that differs from the injected one, because equal versions are no fault."""
    same = any(parse_fault(part).name == f"{RUNS}{declared}" for part in fault.split(","))
    return next((version for version in firmware if version != declared), declared) if same else declared
