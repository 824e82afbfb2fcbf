"""Cases that a played owner goes through to their end: which part they convict, in how many steps and minutes."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from random import Random
from statistics import median
from typing import NamedTuple

from owner import is_right, play

from figures import Rows
from figures.strangers import FIFTH, FIRST, FOURTH, SECOND, THIRD
from hil.faults import CATALOGUE
from hil.faults.fault import Fault, Injection
from model.geometry import Side

SEED = 480_000
"""Of what is drawn; no rule was mended by these."""
DRAWN, PAIRS, HEALTHY = 46, 8, 10
WORKERS = 2
SIDES: tuple[Side, ...] = ("right", "left")


class PlayedSet(NamedTuple):
    """A row of the table."""

    name: str
    first_seed: int
    """Of the first hand; each case has a hand of its own."""
    faults: Sequence[Sequence[Injection]]


def sets() -> tuple[PlayedSet, ...]:
    """Return what is played: faults of the catalogue, strangers, two at once, none."""
    random = Random(SEED)

    def drawn(fault: Fault) -> Injection:
        channel = random.choice(fault.channels) if fault.channels else None
        return fault.at(random.choice(fault.steps()[1:] or fault.steps()), channel)

    catalogue = [drawn(fault) for fault in random.sample(list(CATALOGUE.values()), DRAWN)]
    at_once = [(catalogue[2 * i], catalogue[2 * i + 1]) for i in range(PAIRS)]
    return (
        PlayedSet("faults of the catalogue", 480_000, [(one,) for one in catalogue]),
        PlayedSet("strangers, the first set", 440_100, [(one,) for one in FIRST]),
        PlayedSet("the second", 451_000, [(one,) for one in SECOND]),
        PlayedSet("the third", 452_000, [(one,) for one in THIRD]),
        PlayedSet("the fourth", 456_000, [(one,) for one in FOURTH]),
        PlayedSet("the fifth, and three healthy hands", 470_000, [*((one,) for one in FIFTH), (), (), ()]),
        PlayedSet("two faults at once", 440_200, at_once),
        PlayedSet("none", 440_300, [()] * HEALTHY),
    )


ALL = sets()


@dataclass(frozen=True)
class CaseEnd:
    """The end of a case, as a row counts it."""

    case: str
    """Its faults."""
    found: bool
    """Whether the validation failed."""
    right: bool
    """Whether the convicted part is that of a fault."""
    convicted: str
    """Empty for none."""
    gone: bool
    """Whether the failure was gone, and no part convicted."""
    steps: int
    minutes: float
    """Of the owner's time."""
    ended: str
    """Error that ended it; empty for none."""
    seconds: float
    """Of computing."""


def played(row: int, number: int) -> CaseEnd:
    """Play one case of a set."""
    faults, seed = ALL[row].faults[number], ALL[row].first_seed + number
    side = SIDES[number // 2 % 2]
    one = play(faults, f"plausible:{seed}", seed, ("0.2.0", "0.1.5")[number % 2], side)
    told = one.told
    return CaseEnd(
        " ".join(map(str, faults)),
        one.found,
        any(is_right(suspect, fault) for suspect in told for fault in faults),
        ", ".join(map(str, told)),
        one.gone,
        0 if one.case is None else len(one.case.done),
        one.minutes,
        one.ended,
        one.seconds,
    )


def _played(at: tuple[int, int]) -> CaseEnd:
    return played(*at)


def cases() -> Rows:
    """What whole cases end with, played on guarded hands that are opened anew for each step."""
    rows = [["set", "found", "part right", "good part convicted", "gone", "open", "steps", "minutes"]]
    with ProcessPoolExecutor(WORKERS, get_context("fork")) as pool:
        for number, one in enumerate(ALL):
            rows.append(row(one.name, list(pool.map(_played, [(number, i) for i in range(len(one.faults))]))))
    return rows


def row(name: str, ends: Sequence[CaseEnd]) -> list[str]:
    """Return the row of a set."""
    found = [one for one in ends if one.found]
    convicted = [one for one in found if one.convicted]
    right, gone = sum(one.right for one in convicted), sum(one.gone for one in found)
    steps = [one.steps for one in found] or [0]
    return [
        name,
        f"{len(found)} of {len(ends)}",
        f"{right} of {len(found)}",
        f"{len(convicted) - right} of {len(found)}",
        f"{gone} of {len(found)}",
        f"{len(found) - len(convicted) - gone} of {len(found)}",
        f"{median(steps):g}, at most {max(steps)}",
        f"{median([one.minutes for one in found] or [0]):g}",
    ]


TABLES = (cases,)
