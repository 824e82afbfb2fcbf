"""Which trials a campaign consists of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import cycle, islice, product
from typing import get_args

import numpy as np

from aero.firmware import ALIKE, DEFAULT_FIRMWARE
from hil.faults import parse_fault
from hil.faults.board import RUNS
from hil.lab.campaign.trial import Trial
from model.geometry import Side
from model.units import shipped_units
from model.units.conditions import KINDS
from model.units.naming import PLAUSIBLE

SIDES: tuple[Side, ...] = get_args(Side)
USUAL_FIRMWARE = (DEFAULT_FIRMWARE, "0.1.5")
"""What is found on hands: the newest, and the newest without its shifted windows."""


def healthy_hands(
    first: int, count: int, firmware: Sequence[str] = USUAL_FIRMWARE, conditions: Sequence[str] | None = None
) -> list[Trial]:
    """Return trials of healthy hands with seeds from `first` on, homed: sides, firmware and guard in turn.

    Args:
        first: the first seed.
        count: how many hands.
        firmware: versions that take turns.
        conditions: kinds of condition that all are found under; when None every kind, for half of the hands.
    """
    under = ((), KINDS) if conditions is None else (tuple(conditions),)
    kinds = islice(cycle(product(under, (False, True), firmware, SIDES)), count)
    return [
        Trial(f"{PLAUSIBLE}{first + i}", side, version, first + i, guarded=guarded, conditions=found)
        for i, (found, guarded, version, side) in enumerate(kinds)
    ]


def shipped_hands(seed: int = 0) -> list[Trial]:
    """Return trials of the shipped units: one firmware of each group, homed and in ideal zeros, sides in turn."""
    versions = [group[-1] for group in ALIKE]
    kinds = product(shipped_units(), versions, (True, False))
    return [
        Trial(unit, side, version, seed, homed)
        for (unit, version, homed), side in zip(kinds, cycle(SIDES), strict=False)
    ]


def faulty_hands(
    faults: Sequence[str], first: int, hands: int, firmware: Sequence[str] = USUAL_FIRMWARE
) -> list[Trial]:
    """Return a trial of each fault on each of `hands` hands of its own, with seeds from `first` on.

    A text that holds several faults, with commas between, puts all of them into one hand.

    They are not guarded: a guard ends a run that would tell more. Nor are they under any condition.
    """
    every = healthy_hands(first, hands * len(faults), firmware, ())
    return [
        replace(hand, faults=tuple(fault.split(",")), guarded=False, firmware=_other(hand.firmware, fault, firmware))
        for fault, hand in zip(np.repeat(faults, hands).tolist(), every, strict=True)
    ]


def _other(declared: str, fault: str, firmware: Sequence[str]) -> str:
    """Return a version to declare; a board that runs what was declared has no fault."""
    same = any(parse_fault(part).name == f"{RUNS}{declared}" for part in fault.split(","))
    return next((version for version in firmware if version != declared), declared) if same else declared
