"""`aero-hil limits`: compute the limits from the healthy hands of a campaign."""

from __future__ import annotations

from pathlib import Path

import click

from aero.whole_file import write_whole
from hil.cli.exits import given
from hil.lab.campaign.population import healthy_hands_of
from hil.lab.campaign.store import NAME, opened
from hil.lab.limits.checks import load_checks
from hil.lab.limits.compute import FALSE_ALARMS, computed_limits, own_limits
from hil.lab.limits.writing import limits_text
from hil.recordings.output import prepared_folder
from hil.verdict.limits import kinds
from model.units import DEFAULT_LIMITS


@click.command()
@click.argument("campaign", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), required=True,
    help="Folder for one file for each kind of hand; `hil/data/limits` of a checkout replaces the project's.",
)  # fmt: skip
def limits(*, campaign: Path, out: Path) -> None:
    """Compute the limits from the healthy hands of CAMPAIGN, a folder that `aero-hil campaign --healthy` made."""
    checks = load_checks()
    with given(), opened(campaign, read_only=True) as store:
        outcomes = tuple(store.outcomes())
        groups = healthy_hands_of(outcomes)
        base = computed_limits(checks, groups)
        prepared_folder(out)
    provenance: dict[str, str | int | float] = {
        "population": "model/units/plausible.py, homed, both sides",
        "hands": sum(1 for outcome in outcomes if not outcome.trial.faults),
        "seeds": _seeds([outcome.trial.seed for outcome in outcomes if not outcome.trial.faults]),
        "false_alarms": FALSE_ALARMS,
        "commit": ", ".join(sorted({outcome.commit for outcome in outcomes})),
    }
    for kind in kinds():
        own = base if kind == DEFAULT_LIMITS else own_limits(checks, base, healthy_hands_of(outcomes, kind))
        path = out / f"{kind}.toml"
        write_whole(path, limits_text(own, provenance, extends="" if kind == DEFAULT_LIMITS else DEFAULT_LIMITS))
        click.echo(f"{path}: {len(own)} limits")
    click.echo(f"from {provenance['hands']} healthy hands in {campaign / NAME}")


def _seeds(seeds: list[int]) -> str:
    return f"{min(seeds)} to {max(seeds)}"
