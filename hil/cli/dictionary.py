"""`aero-hil dictionary`: learn what each fault does to the readings from a campaign."""

from __future__ import annotations

from pathlib import Path

import click

from hil.campaign.learning import entries
from hil.campaign.store import opened
from hil.cli.exits import given
from hil.diagnosis.dictionary import FILE, dictionary_text
from hil.recordings.output import prepared_folder


@click.command()
@click.argument("campaign", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), required=True,
    help="Folder for dictionary.json; `hil/diagnosis` of a checkout replaces the project's.",
)  # fmt: skip
def dictionary(*, campaign: Path, out: Path) -> None:
    """Learn what each fault does to the readings from CAMPAIGN, which `aero-hil campaign --fault all` made."""
    with given(), opened(campaign, read_only=True) as store:
        outcomes = [outcome for outcome in store.outcomes() if outcome.trial.faults]
        found = entries(outcomes)
        prepared_folder(out)
    seeds = sorted({outcome.trial.seed for outcome in outcomes})
    provenance: dict[str, str | int] = {
        "trials": len(outcomes),
        "seeds": f"{seeds[0]} to {seeds[-1]}" if seeds else "",
        "commit": ", ".join(sorted({outcome.commit for outcome in outcomes})),
    }
    (out / FILE).write_text(dictionary_text(found, provenance), encoding="utf-8")
    click.echo(f"{out / FILE}: {len(found)} entries of {len(outcomes)} faulty hands")
