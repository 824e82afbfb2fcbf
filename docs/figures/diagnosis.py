"""Cases that an emulated owner plays to their end: which part they convict, in how many steps and minutes."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from random import Random
from statistics import median
from typing import NamedTuple

from fourth_strangers import FOURTH
from more_strangers import MORE
from owner import Played, play
from strangers import STRANGERS
from third_strangers import THIRD

from figures import Rows
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
        PlayedSet(
            "strangers, by which rules were mended: the first set", 440_100, [(_injected(one),) for one in STRANGERS]
        ),
        PlayedSet("the second", 451_000, [(one,) for one in MORE]),
        PlayedSet("the third, after rules were mended by it", 452_000, [(one,) for one in THIRD]),
        PlayedSet("the fourth, the same", 456_000, [(one,) for one in FOURTH]),
        PlayedSet("two faults at once", 440_200, at_once),
        PlayedSet("none", 440_300, [()] * HEALTHY),
    )


def _injected(one: Fault | Injection) -> Injection:
    return one.at() if isinstance(one, Fault) else one


ALL = sets()


def _played(at: tuple[int, int]) -> Played:
    row, number = at
    seed = ALL[row].first_seed + number
    return play(
        ALL[row].faults[number],
        f"plausible:{seed}",
        seed,
        ("0.2.0", "0.1.5")[number % 2],
        SIDES[number // 2 % 2],
    )


def cases() -> Rows:
    """What whole cases end with, played on emulated hands."""
    rows = [["set", "found", "part right", "good part convicted", "gone by itself", "unknown", "steps", "minutes"]]
    with ProcessPoolExecutor(WORKERS, get_context("fork")) as pool:
        for number, one in enumerate(ALL):
            rows.append(_row(one.name, list(pool.map(_played, [(number, i) for i in range(len(one.faults))]))))
    return rows


def _row(name: str, played: Sequence[Played]) -> list[str]:
    found = [one for one in played if one.found]
    convicted = [one for one in found if one.convicted is not None]
    right = sum(one.right for one in convicted)
    gone = sum(one.gone_by_itself for one in found)
    steps = [len(one.case.done) for one in found if one.case is not None] or [0]
    return [
        name,
        f"{len(found)} of {len(played)}",
        f"{right} of {len(found)}",
        f"{len(convicted) - right} of {len(found)}",
        f"{gone} of {len(found)}",
        f"{len(found) - len(convicted) - gone} of {len(found)}",
        f"{median(steps):g}, at most {max(steps)}",
        f"{median([one.minutes for one in found] or [0]):g}",
    ]


TABLES = (cases,)
