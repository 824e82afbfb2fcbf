"""`aero-hil shipped`: what is out of date among the files that ship, and why."""

from __future__ import annotations

import sys

import click

from aero.exit_code import Exit
from hil.cli.exits import usage_errors
from hil.cli.output import echo
from train.shipped import TABLE, load, made, problems, store


@click.command()
@click.option("--check", is_flag=True, help="Print only outdated files; exit with 1 if there are any.")
@click.option("--made", "file", metavar="FILE", help="Mark FILE as made by the checked-out commit.")
@click.option("--reason", default="", help="With --made: reason why the changes since then are harmless.")
def shipped(*, check: bool, file: str | None, reason: str) -> None:
    """List the shipped files with the command and commit that made them, and the outdated ones.

    Requires a checkout with complete history.
    """
    with usage_errors():
        artefacts = load()
        if file is not None:
            artefacts = made(artefacts, file, reason)
            store(artefacts, TABLE)
        wrong = 0
        for artefact in artefacts:
            found = list(problems(artefact))
            wrong += bool(found)
            if found or not check:
                echo(f"{', '.join(artefact.files)}: {artefact.command}, commit {artefact.commit}")
            for line in found:
                echo(f"  {line}")
            if artefact.reason and not check:
                echo(f"  inputs changed until {artefact.until}: {artefact.reason}")
    sys.exit(Exit.OUT_OF_LIMITS if check and wrong else 0)
