"""`python -m train.limits`: population of healthy hands, their validation, and the limits computed from both."""

from collections.abc import Sequence
from pathlib import Path

import click
import tomli_w

from aero.whole_file import write_whole
from hil.checks import BOUNDS
from hil.cli.exits import run_module, usage_errors
from hil.cli.output_files import FOLDER
from hil.dialogue.terminal import console as new_console
from hil.verdict.limits import limits_text
from train.campaign.store import opened
from train.campaign.trial import Outcome
from train.cli.campaign import WORKERS, Workers, run_trials
from train.limits.compute import FALSE_ALARMS, computed_limits
from train.limits.population import GENERATOR, drawn, healthy_hands_of, held_out

COMMAND = "python -m train.limits --out build/limits --data hil/data"


@click.command()
@click.option(
    "--out", type=FOLDER, required=True,
    help="Folder of the campaign; an interrupted one is resumed.",
)  # fmt: skip
@click.option(
    "--data", type=FOLDER,
    help="Folder of limits.csv and population.toml, default: OUT; `hil/data` updates a checkout.",
)  # fmt: skip
@WORKERS
def limits(*, out: Path, data: Path | None, workers: Workers) -> None:
    """Draw a population of healthy hands, validate each, and compute a limit for each check, subject and firmware.

    The seeds of the hands are fixed, so a program version always computes the same table, in an hour on two
    cores. The cross-validated number of false alarms is printed.
    """
    console = new_console()
    with usage_errors():
        folder, place = FOLDER.prepared(out), FOLDER.prepared(data or out)
        opening = opened(folder)
    trials = drawn()
    with opening as store:
        run_trials(console, trials, store, workers, folder)
        done = {outcome.trial.key: outcome for outcome in store.outcomes()}
    outcomes = [done[trial.key] for trial in trials]
    table = computed_limits(BOUNDS, healthy_hands_of(outcomes))
    flagged, judged = held_out(outcomes)
    write_whole(place / "limits.csv", limits_text(table))
    write_whole(place / "population.toml", provenance_text(outcomes, flagged, judged))
    console.print(f"limits from four fifths of the hands flag {flagged} of the other {judged}")
    console.print(f"{place / 'limits.csv'}: {len(table)} limits from {len(outcomes)} healthy hands")


def provenance_text(outcomes: Sequence[Outcome], flagged: int, judged: int) -> str:
    """Return the origin of a table of limits (hands, commit, seeds) as TOML."""
    seeds = [outcome.trial.seed for outcome in outcomes]
    table = {
        "command": COMMAND,
        "commit": outcomes[0].commit,
        "generator": GENERATOR,
        "hands": len(outcomes),
        "seeds": [min(seeds), max(seeds)],
        "false_alarms": FALSE_ALARMS,
        "flagged_by_the_others": [flagged, judged],
    }
    head = "# What limits.csv was made from; train/limits/population.py draws the hands.\n"
    return head + tomli_w.dumps(table)


if __name__ == "__main__":
    run_module(limits)
