"""`aero-hil learn`: what the faults of a campaign do to the readings, and what each check can see of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from aero.whole_file import write_whole
from hil.cli.exits import usage_errors
from hil.lab.campaign.detected_faults import by_fault, detected_text
from hil.lab.campaign.kept_readings import DICTIONARY, DRAWN, write_kept
from hil.lab.campaign.learning import entries, telling
from hil.lab.campaign.store import opened
from hil.lab.campaign.summary import detections, false_alarms, sights
from hil.lab.campaign.trusting import learn as learn_from
from hil.recordings.output import prepared_file
from hil.recordings.provenance import command_line
from hil.verdict import dictionary, reference, sight
from hil.verdict.dictionary import dictionary_text, load_dictionary, rounded
from hil.verdict.likeness import Known
from hil.verdict.reference import load_reference

GENERATOR = "model/units/plausible.py, homed, both sides, with a fault of the catalogue each; healthy ones besides"


@click.command()
@click.argument("campaign", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), required=True,
    help="Folder for dictionary.json and sight.json; `hil/data` of a checkout replaces the project's.",
)  # fmt: skip
@click.option(
    "--detected", type=click.Path(dir_okay=False, path_type=Path),
    help="Also write what was found of each fault; docs/figures/stored/detected_faults.json of a checkout makes the "
    "table of docs/detection.md.",
)  # fmt: skip
@click.option(
    "--drawn", is_flag=True,
    help="CAMPAIGN is of `--drawn` hands: write drawn.json, which adds to the dictionary, and places.json, which tells "
    "where faults sit and how far both can be trusted. Nothing else is written.",
)  # fmt: skip
@click.option(
    "--hands-only", is_flag=True, help="Leave the dictionary as it is, and write only what three of the hands read."
)
def learn(*, campaign: Path, out: Path, detected: Path | None, drawn: bool, hands_only: bool) -> None:
    """Learn from CAMPAIGN, a folder that `aero-hil campaign --healthy N --fault all` made, by the present limits."""
    with usage_errors(), opened(campaign, read_only=True) as store:
        outcomes, commands = store.whole_outcomes(), store.commands()
        faulty = telling(outcomes)
        learned = learn_from(faulty, load_dictionary(dictionary.FILE)) if drawn else None
        write_kept(out, DRAWN if drawn else DICTIONARY, [hand for hand in faulty if not hand.stopped])
        if detected is not None:
            prepared_file(detected)
    if hands_only:
        return
    seeds = [outcome.trial.seed for outcome in outcomes]
    provenance: dict[str, str | int | list[str]] = {
        "healthy": sum(not outcome.trial.faults for outcome in outcomes),
        "faulty": sum(bool(outcome.trial.faults) for outcome in outcomes),
        "seeds": f"{min(seeds)} to {max(seeds)}" if seeds else "",
        "commit": ", ".join(sorted({outcome.commit for outcome in outcomes})),
        "generator": GENERATOR,
        "commands": [*commands, command_line()],
    }
    found = [rounded(entry) for entry in entries(outcomes)]
    write_whole(out / (dictionary.DRAWN if drawn else dictionary.FILE), dictionary_text(found, provenance))
    if learned is not None:
        write_whole(out / reference.FILE, reference.reference_text(learned.placing, learned.trust, provenance))
        click.echo(f"{len(found)} entries in {out}")
        return
    seen = sights(outcomes)
    write_whole(out / sight.FILE, sight.sight_text(seen, provenance))
    if detected is not None:
        healthy = any(not outcome.trial.faults for outcome in outcomes)
        alarms = false_alarms(outcomes)[0] if healthy else None
        now = replace(load_reference(), known=Known(found, load_reference().placing.usual))
        write_whole(detected, detected_text(by_fault(detections(outcomes, now)), alarms, provenance))
    click.echo(f"{len(found)} entries, {len(seen)} checks in {out}")
