"""`aero-hil limits`: compute the limits from the healthy hands of a campaign."""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from aero.whole_file import write_whole
from hil.checks import ALIKE, CHECKS, DEFAULT, DRIVER, WHOLE_RUN
from hil.cli.exits import usage_errors
from hil.cli.output import echo
from hil.recordings.provenance import command_line
from hil.verdict.limits import Limit, read_limits, read_provenance, without
from model.units import DEFAULT_LIMITS
from train.campaign.store import NAME, opened
from train.campaign.trial import Outcome
from train.limits.compute import FALSE_ALARMS, LEAST_HANDS, computed_limits, own_limits, widened
from train.limits.kept_readings import write_kept
from train.limits.population import healthy_hands_of, held_out, kind_of, kinds_of, require_enough

POPULATION = (
    "model/units/plausible.py, homed, both sides, half of them under conditions of model/units/conditions.py; and the "
    "shipped units of this kind"
)
WIDENED = "widened"
"""What the tables of provenance begin with that say which hands widened a file."""
SHIPPED = "the shipped units of this kind, homed and in ideal zeros, each group of firmware"


@click.command()
@click.argument("campaign", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), required=True,
    help="Folder for one file for each kind of hand; `hil/data/limits` of a checkout replaces the project's.",
)  # fmt: skip
@click.option(
    "--hands-only", is_flag=True, help="Leave the limits as they are, and write only what three of the hands read."
)
@click.option(
    "--widen", is_flag=True,
    help="Keep the present limits, move out those that do not hold a hand of CAMPAIGN, and add those of new checks.",
)  # fmt: skip
def limits(*, campaign: Path, out: Path, hands_only: bool, widen: bool) -> None:
    """Compute the limits from the healthy hands of CAMPAIGN, a folder that `aero-hil campaign --healthy` made.

    A campaign of shipped units alone (`--shipped`) makes those kinds of hand anew that depart from the population,
    beside the present limits of the population. One of some experiments alone (`--only`) makes their limits anew,
    beside the present limits of the others. A campaign with too few healthy hands for limits is refused. Of a larger
    one, the false alarms on hands that the limits were not made from are printed.
    """
    with usage_errors(), opened(campaign, read_only=True) as store:
        commands = store.commands()
        outcomes = [outcome for outcome in store.whole_outcomes() if not outcome.trial.faults]
        made = kinds_of(outcomes)
        if not made:
            raise ValueError(f"no healthy hand in {campaign / NAME} makes limits; run `aero-hil campaign --healthy`")
        if DEFAULT_LIMITS in made and not (widen or hands_only):
            require_enough(outcomes)
        by_kind = {kind: [outcome for outcome in outcomes if kind_of(outcome.trial.unit) == kind] for kind in made}
        for kind, hands in by_kind.items():
            write_kept(out, kind, hands)
        if hands_only:
            return
        if widen:
            for kind in made:
                _widen(out, kind, by_kind[kind], [*commands, command_line()])
            return
        population = DEFAULT_LIMITS in made
        anew = _made_anew(outcomes)
        base = (
            computed_limits(CHECKS, healthy_hands_of(outcomes), anew) if population else read_limits(DEFAULT_LIMITS)[1]
        )
    if population:
        accused, judged = held_out(outcomes, anew)
        echo(f"limits from four fifths of these hands flag {accused} of the other {judged}")
    for kind in made:
        own = base if kind == DEFAULT_LIMITS else own_limits(CHECKS, base, healthy_hands_of(outcomes, kind))
        kept = tuple(limit for limit in read_limits(kind)[1] if limit.experiment not in anew)
        both = (*kept, *(limit for limit in own if limit.experiment in anew))
        hands = by_kind[kind]
        provenance = {**_origin(kind, hands, [*commands, command_line()]), "false_alarms": FALSE_ALARMS}
        extends = "" if kind == DEFAULT_LIMITS else DEFAULT_LIMITS
        path = out / f"{kind}.toml"
        of_file = _beside(read_provenance(kind), provenance, anew)
        write_whole(path, limits_text(both, of_file, extends=extends))
        echo(f"{path}: {len(both) - len(kept)} limits from {len(hands)} healthy hands, {len(kept)} kept")


def _origin(kind: str, hands: Sequence[Outcome], commands: Sequence[str]) -> dict[str, str | int | float | list[str]]:
    """Return which hands are behind a file of limits."""
    return {
        "hands": len(hands),
        "seeds": f"{min(h.trial.seed for h in hands)} to {max(h.trial.seed for h in hands)}",
        "commit": ", ".join(sorted({hand.commit for hand in hands})),
        "generator": POPULATION if kind == DEFAULT_LIMITS else SHIPPED,
        "commands": [*map(_anywhere, commands)],
    }


def _anywhere(command: str) -> str:
    """Return a command with the names of its folders alone: where they lay on one machine says nothing elsewhere."""
    _, *words = shlex.split(command)
    return shlex.join(["aero-hil", *(Path(word).name if Path(word).is_absolute() else word for word in words)])


def _widen(out: Path, kind: str, hands: Sequence[Outcome], commands: Sequence[str]) -> None:
    """Write the present limits of a kind, those of another that do not hold its hands, and those of new checks.

    New are those of checks that have none, from enough hands; with a guard or without one their readings are alike.
    """
    extends, own = read_limits(kind)
    known = {(limit.experiment, limit.metric) for limit in own}
    new: tuple[Limit, ...] = ()
    if not extends and len(hands) >= LEAST_HANDS:
        unguarded = [replace(hand, trial=replace(hand.trial, guarded=False)) for hand in hands]
        every = computed_limits(
            CHECKS, [group for group in healthy_hands_of(unguarded) if group.population], _made_anew(hands)
        )
        new = tuple(limit for limit in every if (limit.experiment, limit.metric) not in known)
    inherited = without(read_limits(extends)[1], own) if extends else ()
    groups = healthy_hands_of(hands, kind)
    wider, changed = widened(CHECKS, own, groups), widened(CHECKS, inherited, groups)
    beyond = [new for old, new in zip(inherited, changed, strict=True) if _bounds(old) != _bounds(new)]
    moved = len(beyond) + sum(_bounds(old) != _bounds(new) for old, new in zip(own, wider, strict=True))
    present = read_provenance(kind)
    name = f"{WIDENED}_{1 + sum(table.startswith(WIDENED) for table in present)}"
    path = out / f"{kind}.toml"
    made = {**present, name: _origin(kind, hands, commands)}
    write_whole(path, limits_text((*wider, *beyond, *new), made, extends=extends))
    echo(f"{path}: {moved} limits widened for {len(hands)} healthy hands, {len(new)} new")


def _bounds(limit: Limit) -> tuple[float, float]:
    return limit.at_least, limit.at_most


def _made_anew(outcomes: Sequence[Outcome]) -> set[str]:
    """Return the experiments that every hand went through; the run as a whole is judged after a whole one."""
    asked = set.intersection(*(set(outcome.trial.experiments) for outcome in outcomes))
    return asked | {WHOLE_RUN.name, DRIVER.name, ALIKE.name} if asked.issuperset(DEFAULT) else asked


def _beside(present: Provenance, fresh: Provenance, anew: set[str]) -> Provenance:
    """Return what made a file: its experiments together, and in tables those that were made anew alone."""
    if WHOLE_RUN.name not in anew:
        return {**present, **dict.fromkeys(sorted(anew), fresh)}
    # What had widened the limits of before has no part in these.
    old = {name for name in present if name in anew or name.startswith(WIDENED)}
    tables = {name: one for name, one in present.items() if isinstance(one, Mapping) and name not in old}
    return {**fresh, **tables}


Provenance = Mapping[str, Any]
"""What made a file, and by its name what made an experiment's limits anew, as a table within."""


def limits_text(limits: Sequence[Limit], provenance: Provenance, *, extends: str = "") -> str:
    """Return limits as TOML that `load_limits` reads."""
    lines = ["# Made by `aero-hil limits`; change `checks.toml` or the population, and make it again."]
    if extends:
        lines.append(f"extends = {json.dumps(extends)}")
    tables = {name: value for name, value in provenance.items() if isinstance(value, Mapping)}
    own = {key: value for key, value in provenance.items() if key not in tables}
    named = {"provenance": own, **{f"provenance.{name}": table for name, table in tables.items()}}
    for name, table in ((name, table) for name, table in named.items() if table):
        lines += ["", f"[{name}]", *(f"{key} = {json.dumps(value)}" for key, value in table.items())]
    for limit in limits:
        bounds = {"at_least": limit.at_least, "at_most": limit.at_most}
        lines += [
            "",
            "[[limit]]",
            f"experiment = {json.dumps(limit.experiment)}",
            f"metric = {json.dumps(limit.metric)}",
            f"subjects = {json.dumps(list(limit.subjects))}",
            *([f"firmware = {json.dumps(list(limit.firmware))}"] if limit.firmware else []),
            *([f"guarded = {json.dumps(limit.guarded)}"] if limit.guarded is not None else []),
            *(f"{name} = {value:g}" for name, value in bounds.items() if math.isfinite(value)),
            *([f"healthy = [{limit.healthy[0]:g}, {limit.healthy[1]:g}]"] if limit.healthy else []),
            f"source = {json.dumps(limit.source)}",
        ]
    return "\n".join(lines) + "\n"
