"""Tables of docs/campaign.md: stored campaigns, judged by the limits and the rules that ship."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from driver_mistakes import GENTLE, MAPPED, MISTAKES, MISTAKES_OF_THE_MAP, named_driver

from figures import Rows
from hil.faults import CATALOGUE, parse_fault
from train.campaign.summary import NOT_FIRED, false_alarms, flagged, right_part, told
from train.campaign.trial import Outcome
from train.share import Share

HEADER = ["", "figure", "95 %"]
WHOLE_HAND = "supply_low"
"""Fault whose location is told for each severity: it moves every channel a little."""


def verdict(outcomes: Sequence[Outcome]) -> Rows:
    """What is found of the faults, and whether the part at fault is suspected; each mistake of the driver."""
    faulty = [one for one in outcomes if len(one.trial.faults) == 1 and one.ended != NOT_FIRED]
    faults = {one.trial.key: parse_fault(one.trial.faults[0]) for one in faulty}
    found = [right_part(faults[one.trial.key], told(one)) for one in faulty if flagged(one)]
    alarms, _ = false_alarms(outcomes)
    rows = [
        HEADER,
        _row("healthy hands flagged", alarms),
        _row("faults found", Share(len(found), len(faulty))),
        _row("part at fault suspected first, of those found", _share(found)),
    ]
    for severity in sorted({fault.severity for fault in faults.values() if fault.name == WHOLE_HAND}):
        hands = [one for one in faulty if faults[one.trial.key] == CATALOGUE[WHOLE_HAND].at(severity)]
        at_supply = [flagged(one) and right_part(faults[one.trial.key], told(one)) for one in hands]
        rows.append(_row(f"supply lower by {severity:g}: found there", _share(at_supply)))
    mistakes = [(one, GENTLE) for one in MISTAKES.values()] + [(one, MAPPED) for one in MISTAKES_OF_THE_MAP.values()]
    named = _share(named_driver(one, experiments) for one, experiments in mistakes)
    return [*rows, _row("mistakes of the driver or its map, named so", named)]


def alarms(outcomes: Sequence[Outcome]) -> Rows:
    """How many healthy hands are flagged, by what they were found under."""
    healthy = [one for one in outcomes if not one.trial.faults]
    kinds = {
        "none": [one for one in healthy if not one.trial.conditions],
        "all kinds at once": [one for one in healthy if one.trial.conditions],
    }
    rows = [["conditions", "seeds", "flagged", "95 %", "for"]]
    for name, some in kinds.items():
        share, checks = false_alarms(some)
        seeds = sorted(one.trial.seed for one in some)
        rows.append([name, f"{seeds[0]} to {seeds[-1]}" if seeds else "-", *_cells(share), ", ".join(checks) or "-"])
    return rows


def _share(right: Iterable[bool]) -> Share:
    told_right = list(right)
    return Share(sum(told_right), len(told_right))


def _row(name: str, share: Share) -> list[str]:
    return [name, *_cells(share)]


def _cells(share: Share) -> list[str]:
    if not share.of:
        return ["-", "-"]
    low, high = share.interval
    return [f"{share.count} of {share.of}", f"{100 * low:.1f} % to {100 * high:.1f} %"]


TABLES: tuple[Callable[[Sequence[Outcome]], Rows], ...] = (verdict, alarms)
