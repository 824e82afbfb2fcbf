"""`aero-hil faults`: list of the faults that can be injected into a hand or a link."""

import json

import click

from aero.channels import Channel
from hil.dialogue.printing import echo
from hil.emulated.faults.catalogue import CATALOGUE, begins, severities, where
from hil.emulated.faults.fault import Fault, FaultLayer

CHANNELS = {channel.label: channel for channel in Channel}


@click.command()
@click.argument("words", nargs=-1, metavar="[WORD]...")
@click.option("--json", "as_json", is_flag=True, help="Print a JSON list of objects.")
def faults(*, words: tuple[str, ...], as_json: bool) -> None:
    """List the faults that can be injected into a hand or a link, by layer.

    A WORD selects the faults of a channel (`ring`), or those with the word in their row (`motor`, `link`).
    """
    chosen = [fault for fault in CATALOGUE.values() if all(_has(fault, word.lower()) for word in words)]
    if as_json:
        rows = [
            {
                "name": fault.name,
                "layer": fault.layer.label,
                "part": fault.part.name.lower(),
                "meaning": fault.words,
                "channels": [channel.label for channel in fault.channels],
                "severities": None if fault.severity is None else fault.severity.steps,
                "unit": "" if fault.severity is None else fault.severity.unit,
                "begins": begins(fault),
            }
            for fault in chosen
        ]
        echo(json.dumps(rows, indent=1))
        return
    formatter = click.HelpFormatter(max_width=100)
    for layer in FaultLayer:
        if of_layer := [fault for fault in chosen if fault.layer is layer]:
            with formatter.section(layer.label):
                formatter.write_dl([(fault.name, _row(fault)) for fault in of_layer], col_max=22)
    echo(formatter.getvalue().strip() or f"No fault has {' and '.join(words)} in its row.")
    echo("\nWritten NAME[:CHANNEL][=SEVERITY][@SECONDS], as in motor_weak:ring=0.4@5")


def _has(fault: Fault, word: str) -> bool:
    if word in CHANNELS:
        return CHANNELS[word] in fault.channels
    return word in f"{fault.layer.label} {fault.name} {_row(fault)}"


def _row(fault: Fault) -> str:
    return f"{fault.words}; {where(fault)}; {severities(fault)}; {begins(fault)}"
