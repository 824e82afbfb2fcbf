"""`python -m figures [NAME...]`: measure tables, and write all tables into their pages."""

from __future__ import annotations

import click
import mujoco

from aero.whole_file import write_whole
from figures import functions, load, pages, store, written

PHYSICS = f"MuJoCo {'.'.join(mujoco.__version__.split('.')[:2])}"


@click.command()
@click.argument("names", nargs=-1, metavar="[NAME]...")
def main(names: tuple[str, ...]) -> None:
    """Measure the tables NAME (or `all`), then write every stored table into its page."""
    known = functions() if names else {}
    for name in known if names == ("all",) else names:
        if name not in known:
            raise click.UsageError(f"{name} is not measured here; measured are {', '.join(known)}, or all")
        store(name, known[name](), origin=PHYSICS if load(name)["origin"] else "")
        click.echo(name)
    for page in pages():
        write_whole(page, written(page))


if __name__ == "__main__":
    main()
