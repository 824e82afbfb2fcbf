"""`aero-hil faults`: the faults that can be injected into a hand or a link."""

from __future__ import annotations

import json
from typing import get_args

import click

from aero.channels import Channel
from hil.faults.catalogue import CATALOGUE, begins, severities, where
from hil.faults.fault import FaultLayer, Kind

CHANNELS = {channel.label: channel for channel in Channel}


@click.command()
@click.argument("words", nargs=-1, metavar="[WORD]...")
@click.option("--json", "as_json", is_flag=True, help="A list of objects, for programs.")
def faults(*, words: tuple[str, ...], as_json: bool) -> None:
    """List the faults that can be injected into a hand or a link, by layer.

    A WORD keeps those that can sit on a channel (`ring`) or have it in their row (`motor`, `link`).
    """
    chosen = [kind for kind in CATALOGUE.values() if all(_has(kind, word.lower()) for word in words)]
    if as_json:
        rows = [
            {
                "name": kind.name,
                "layer": kind.layer,
                "meaning": kind.meaning,
                "channels": [channel.label for channel in kind.subjects],
                "severities": None if kind.is_switch else kind.severities,
                "unit": kind.unit,
                "begins": begins(kind),
            }
            for kind in chosen
        ]
        click.echo(json.dumps(rows, indent=1))
        return
    formatter = click.HelpFormatter(max_width=100)
    for layer in get_args(FaultLayer):
        if of_layer := [kind for kind in chosen if kind.layer == layer]:
            with formatter.section(layer):
                formatter.write_dl([(kind.name, _row(kind)) for kind in of_layer], col_max=22)
    click.echo(formatter.getvalue().strip() or f"No fault has {' and '.join(words)} in its row.")
    click.echo("\nWritten NAME[:CHANNEL][=SEVERITY][@SECONDS], as in motor_weak:ring=0.4@5")


def _has(kind: Kind, word: str) -> bool:
    return CHANNELS[word] in kind.subjects if word in CHANNELS else word in f"{kind.layer} {kind.name} {_row(kind)}"


def _row(kind: Kind) -> str:
    return f"{kind.meaning}; {where(kind)}; {severities(kind)}; {begins(kind)}"
