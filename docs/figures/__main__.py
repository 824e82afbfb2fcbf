"""`python -m figures [--check] [--quick] [PAGE...]`: write the tables of measured figures, or compare them."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from aero.whole_file import write_whole
from figures.pages import measured, moved, pages
from figures.sources import Cost


@click.command()
@click.option("--check", is_flag=True, help="Write nothing; exit with 1 when a figure moved beyond its tolerance.")
@click.option("--quick", is_flag=True, help="Leave out what takes more than a few seconds.")
@click.argument("chosen", nargs=-1, metavar="[PAGE]...", type=click.Path(exists=True, path_type=Path))
def main(check: bool, quick: bool, chosen: tuple[Path, ...]) -> None:
    """Measure the tables of README.md and docs/*.md anew, of all pages or of those that are named."""
    costs = (Cost.QUICK, Cost.STORED) if quick else tuple(Cost)
    changed = False
    for page in [path.resolve() for path in chosen] or pages():
        now = measured(page, costs)
        for line in moved(page, now):
            changed = True
            click.echo(line)
        if not check:
            write_whole(page, now)
    if check and changed:
        click.echo("figures moved by more than their tolerance; `tox -e figures` writes what is measured", err=True)
        sys.exit(1)


if __name__ == "__main__":
    main()
