"""`python -m figures [NAME...]`: measure tables, and write all tables into their pages."""

from __future__ import annotations

from pathlib import Path

import click
import mujoco

from aero.whole_file import write_whole
from figures import from_campaigns, functions, load, pages, store, written
from hil.recordings.provenance import source_commit

PHYSICS = f"MuJoCo {'.'.join(mujoco.__version__.split('.')[:2])}"


@click.command()
@click.argument("names", nargs=-1, metavar="[NAME]...")
@click.option(
    "--campaign", "folders", multiple=True, type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Folder of a campaign to judge for the tables of docs/campaign.md; repeatable.",
)  # fmt: skip
def main(names: tuple[str, ...], folders: tuple[Path, ...]) -> None:
    """Measure the tables NAME (or `all`), then write every stored table into its page."""
    known = functions() if names else {}
    judged = from_campaigns(folders) if folders else {}
    for name in known if names == ("all",) else names:
        if name not in known | judged:
            raise click.UsageError(
                f"{name} is not measured here; measured are {', '.join(known)}, or all, "
                "and campaign.verdict and campaign.alarms with --campaign FOLDER"
            )
        if name in judged:
            store(name, judged[name](), origin=f"judged by the limits and rules of commit {source_commit()[:7]}")
        else:
            store(name, known[name](), origin=PHYSICS if load(name)["origin"] else "")
        click.echo(name)
    for page in pages():
        write_whole(page, written(page))


if __name__ == "__main__":
    main()
