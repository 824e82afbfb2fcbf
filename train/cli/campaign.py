"""`aero-hil campaign`: one validation each of many emulated hands, healthy and faulty."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import partial
from itertools import count as count_from
from pathlib import Path

import click
from rich.console import Console

from aero.firmware import FIRMWARE
from aero.safety import unwinding
from aero.whole_file import write_whole
from hil.checks import EXPERIMENTS
from hil.cli.exits import usage_errors
from hil.cli.options import SEED
from hil.cli.output_files import FOLDER
from hil.dialogue.terminal import ProgressBar
from hil.dialogue.terminal import console as new_console
from hil.emulated.faults import CATALOGUE, Schedule, parse_fault
from hil.recordings.output import run_folder
from hil.recordings.provenance import source_commit
from model.units.conditions import CONDITIONS
from train.campaign.store import NAME, Store, missing, opened
from train.campaign.summary import flagged, render_campaign
from train.campaign.trial import USUAL_FIRMWARE, Outcome, Trial, faulty_hands, healthy_hands, perform
from train.workers import conduct, usable_cores, worker_processes

MOST = 1_000_000
"""Limit of hands of one kind in a campaign."""


Workers = Callable[[], AbstractContextManager[Executor]]
"""Factory of executors for trials; called again after the workers have died."""


def _factory(_context: click.Context, _option: click.Parameter, count: int | None) -> Workers:
    return partial(worker_processes, count or usable_cores())


WORKERS = click.option(
    "--workers", type=click.IntRange(1, 1000), callback=_factory, help="Processes; default: one per core."
)
"""Option of the commands that run trials, which receive a factory of executors."""


@click.command()
@click.option("--healthy", type=click.IntRange(0, MOST), default=0, help="Number of healthy hands.")
@click.option(
    "--condition", "conditions", multiple=True, type=click.Choice(CONDITIONS),
    help="Initial condition of all healthy hands, repeatable; default: all kinds on half of the hands.",
)  # fmt: skip
@click.option(
    "--fault", "faults", metavar="FAULT", multiple=True,
    help="Fault of `aero-hil faults`; several for one hand separated by commas; `all` for each fault in its three "
    "severities; repeatable.",
)  # fmt: skip
@click.option("--hands", type=click.IntRange(1, MOST), default=5, show_default=True, help="Number of hands per fault.")
@click.option("--first-seed", type=SEED, default=0, show_default=True, help="Seed of the first hand.")
@click.option("--firmware", type=click.Choice(list(FIRMWARE)), multiple=True, default=USUAL_FIRMWARE, show_default=True,
              help="Firmware version; several alternate.")  # fmt: skip
@click.option("--only", "names", multiple=True, type=click.Choice(list(EXPERIMENTS)), help="Experiment; repeatable.")
@click.option(
    "--out", type=FOLDER,
    help="Folder of the campaign; an interrupted one is resumed. Default: campaign/DATE-AND-TIME.",
)  # fmt: skip
@WORKERS
def campaign(
    *,
    healthy: int,
    conditions: tuple[str, ...],
    faults: tuple[str, ...],
    hands: int,
    first_seed: int,
    firmware: tuple[str, ...],
    names: tuple[str, ...],
    out: Path | None,
    workers: Workers,
) -> None:
    """Validate many emulated hands, and store every number in OUT/campaign.duckdb.

    Each result is stored when its run ends. Ctrl-C loses only the runs in progress; the same command and
    --out resume.
    """
    console = new_console()
    with usage_errors():
        trials = healthy_hands(first_seed, healthy, firmware, conditions or None) if healthy else []
        trials += faulty_hands(_written(faults), first_seed, hands, firmware)
        if names:
            trials = [replace(trial, experiments=names) for trial in trials]
        if not trials:
            raise ValueError("nothing to run; give --healthy or --fault")
        folder = FOLDER.prepared(out) if out is not None else run_folder(Path("campaign"))
        opening = opened(folder)
    with opening as store:
        try:
            run_trials(console, trials, store, workers, folder)
        finally:  # also after an interruption
            _summarise(console, folder, list(store.outcomes()))


def run_trials(console: Console, trials: Sequence[Trial], store: Store, workers: Workers, folder: Path) -> None:
    """Run the trials that are missing from the store, and store each outcome at once.

    Args:
        console: console for the progress bar.
        trials: all trials of the campaign.
        store: store open for writing.
        workers: factory of the executors.
        folder: folder of the store, for messages.

    Raises:
        StoreError: the store has outcomes of another commit, whose numbers may differ.
    """
    store.require_commit(source_commit())
    left = missing(trials, store.keys())
    console.print(f"{len(trials)} runs, {len(trials) - len(left)} done before; {folder / NAME}")
    with unwinding(), ProgressBar() as bar:
        task, ended = bar.add_task(f"0 of {len(left)} runs", total=len(left)), count_from(1)

        def keep(outcome: Outcome) -> None:
            store.add(outcome)
            done = next(ended)
            bar.update(task, completed=done, description=f"{done} of {len(left)} runs")

        try:
            conduct(left, perform, workers, keep)
        finally:
            if (still := len(missing(trials, store.keys()))) > 0:
                console.print(f"{still} of {len(trials)} runs are left; the same command with --out {folder} continues")


def _summarise(console: Console, folder: Path, outcomes: Sequence[Outcome]) -> None:
    """Write the report page and print the number of flagged hands."""
    if not outcomes:
        return
    page = folder / "campaign.html"
    write_whole(page, render_campaign(outcomes))
    for name, some in (
        ("healthy", [outcome for outcome in outcomes if not outcome.trial.faults]),
        ("faulty", [outcome for outcome in outcomes if outcome.trial.faults]),
    ):
        if some:
            console.print(f"{sum(map(flagged, some))} of {len(some)} {name} hands flagged")
    console.print(str(page))


def _written(faults: tuple[str, ...]) -> list[str]:
    """Return the fault texts, with `all` expanded to the whole catalogue.

    Raises:
        ValueError: an unknown or impossible fault, or several that cannot be combined.
    """
    found = []
    for text in faults:
        if text == "all":
            found += [str(fault.at(severity)) for fault in CATALOGUE.values() for severity in sorted(fault.steps())]
        else:
            Schedule(map(parse_fault, text.split(",")))
            found.append(text)
    return found
