"""`aero-hil limits`: compute the limits from the healthy hands of a campaign."""

from __future__ import annotations

from pathlib import Path

import click

from hil.cli.exits import given
from hil.lab.campaign.population import healthy_hands_of, kind_of, kinds_of
from hil.lab.campaign.store import NAME, opened
from hil.lab.limits.checks import load_checks
from hil.lab.limits.compute import FALSE_ALARMS, computed_limits, own_limits
from hil.lab.limits.writing import limits_text
from hil.recordings.output import prepared_folder
from hil.recordings.provenance import command_line
from hil.verdict.limits import read_limits
from model.units import DEFAULT_LIMITS

POPULATION = "model/units/plausible.py, homed, both sides; and the shipped units of this kind"
SHIPPED = "the shipped units of this kind, homed and in ideal zeros, each group of firmware"


@click.command()
@click.argument("campaign", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), required=True,
    help="Folder for one file for each kind of hand; `hil/data/limits` of a checkout replaces the project's.",
)  # fmt: skip
def limits(*, campaign: Path, out: Path) -> None:
    """Compute the limits from the healthy hands of CAMPAIGN, a folder that `aero-hil campaign --healthy` made.

    A campaign of shipped units alone (`--shipped`) makes those kinds of hand anew that depart from the population,
    beside the present limits of the population.
    """
    checks = load_checks()
    with given(), opened(campaign, read_only=True) as store:
        commands = store.commands()
        outcomes = [outcome for outcome in store.outcomes() if not outcome.trial.faults]
        made = kinds_of(outcomes)
        if not made:
            raise ValueError(f"no healthy hand in {campaign / NAME} makes limits; run `aero-hil campaign --healthy`")
        population = DEFAULT_LIMITS in made
        base = computed_limits(checks, healthy_hands_of(outcomes)) if population else read_limits(DEFAULT_LIMITS)[1]
        prepared_folder(out)
    for kind in made:
        own = base if kind == DEFAULT_LIMITS else own_limits(checks, base, healthy_hands_of(outcomes, kind))
        hands = [outcome for outcome in outcomes if kind_of(outcome.trial.unit) == kind]
        provenance: dict[str, str | int | float | list[str]] = {
            "hands": len(hands),
            "seeds": f"{min(h.trial.seed for h in hands)} to {max(h.trial.seed for h in hands)}",
            "false_alarms": FALSE_ALARMS,
            "commit": ", ".join(sorted({hand.commit for hand in hands})),
            "generator": POPULATION if kind == DEFAULT_LIMITS else SHIPPED,
            "commands": [*commands, command_line()],
        }
        extends = "" if kind == DEFAULT_LIMITS else DEFAULT_LIMITS
        path = out / f"{kind}.toml"
        path.write_text(limits_text(own, provenance, extends=extends), encoding="utf-8")
        click.echo(f"{path}: {len(own)} limits from {len(hands)} healthy hands")
