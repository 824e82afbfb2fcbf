"""`aero-hil faults`: the catalogue of faults as a table."""

from __future__ import annotations

import click

from hil.faults.catalogue import markdown


@click.command()
def faults() -> None:
    """List the faults that can be put into a hand or a link, with units and severities."""
    click.echo(markdown())
