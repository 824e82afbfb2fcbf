"""`python -m figures [NAME...]`: make tables whole, then write all stored ones into their pages; `--sample` checks."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable

import click

from aero.exit_code import Exit
from aero.whole_file import write_whole
from figures import pages, written
from figures.made import everything, make, sampled
from figures.results import load


@click.command()
@click.argument("names", nargs=-1, metavar="[NAME]...")
@click.option(
    "--sample", is_flag=True,
    help="Remake only a sample of each, of all whose inputs have changed if none is named; exit with 1 if one differs.",
)  # fmt: skip
@click.option("--jobs", default=os.cpu_count(), show_default=True, help="Samples at once.")
def main(names: tuple[str, ...], sample: bool, jobs: int) -> None:
    """Make the tables or shipped files NAME whole, then write all tables into their pages."""
    known = everything()
    if unknown := [name for name in names if name not in known]:
        raise click.UsageError(f"{unknown[0]} is not made here; made are {', '.join(known)}")
    if sample:
        sys.exit(remake_samples(names or [name for name in known if load(name).stale], jobs))
    for name in names:
        found = make(name)
        click.echo(f"{name}: {found.differs or 'stored'}")
    for page in pages():
        write_whole(page, written(page))


def remake_samples(names: Iterable[str], jobs: int) -> Exit:
    """Remake samples and print what is found of each; return the exit code."""
    differ = 0
    for name, found in sampled(names, jobs):
        click.echo(f"{name}: {'differs; ' + found.differs if found.differs else 'equal'}")
        differ += bool(found.differs)
    return Exit.OUT_OF_LIMITS if differ else Exit.WITHIN_LIMITS


if __name__ == "__main__":
    main()
