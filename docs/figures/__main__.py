"""`python -m figures [NAME...]`: measure tables, then write all stored ones into their pages; `--check` compares."""

from __future__ import annotations

import sys
import time

import click
import mujoco

from aero.exit_code import Exit
from aero.whole_file import write_whole
from figures import ANOTHER_MUJOCO, EXCUSED, differences, functions, load, pages, store, written
from hil.recordings.provenance import source_commit

MUJOCO = f"MuJoCo {'.'.join(mujoco.__version__.split('.')[:2])}"


@click.command()
@click.argument("names", nargs=-1, metavar="[NAME]...")
@click.option("--check", is_flag=True, help="Write nothing; exit with 1 if a figure differs from the stored one.")
def main(names: tuple[str, ...], check: bool) -> None:
    """Measure the tables NAME (or `all`), then write every stored table into its page."""
    known = functions() if names or check else {}
    for name in names:
        if name not in known and name != "all":
            raise click.UsageError(f"{name} is not measured here; measured are {', '.join(known)}, or all")
    chosen = [name for name in known if name in names or "all" in names or not names]
    if check:
        sys.exit(checked(chosen, all_of_them=not names))
    if chosen and not source_commit():
        raise click.UsageError("a stored figure names its commit, and git does not know it here")
    for name in chosen:
        rows = known[name]()
        store(name, rows, origin=f"commit {source_commit()}, {MUJOCO}")
        click.echo(name)
    for page in pages():
        write_whole(page, written(page))


def checked(names: list[str], *, all_of_them: bool) -> Exit:
    """Print the differences of each table, and the tables that are not measured; return the exit code."""
    bad = [page.name for page in pages() if written(page) != page.read_text(encoding="utf-8")]
    for name in bad:
        click.echo(f"{name}: differs from the stored tables; `tox -e figures` writes them")
    for name, reason in EXCUSED.items() if all_of_them else ():
        click.echo(f"{name}: not measured, {reason}; {load(name)['origin']}")
    for name in names:
        began, stored = time.monotonic(), load(name)
        tolerance = 0.0 if MUJOCO in stored["origin"] else ANOTHER_MUJOCO
        found = list(differences(stored["rows"], functions()[name](), tolerance))
        click.echo(
            f"{name}: {'differs' if found else 'agrees'} with {stored['origin']}; {time.monotonic() - began:.0f} s"
        )
        for line in found:
            click.echo(f"  {line}")
        bad += [name] if found else []
    return Exit.OUT_OF_LIMITS if bad else Exit.WITHIN_LIMITS


if __name__ == "__main__":
    main()
