"""`aero-hil diagnose`: which part of a hand that failed is at fault, step by step."""

from __future__ import annotations

from pathlib import Path

import click

from hil.cli.options import target
from hil.targets.hand_spec import HandSpec


@click.command()
@click.argument("case", type=click.Path(exists=True, file_okay=False, path_type=Path), default="validation/latest")
@target
def diagnose(*, hand: HandSpec, case: Path) -> None:
    """Isolate the part at fault of a hand that failed: the next step, then only what shows the failure, compared.

    CASE is the folder of the run that failed, validation/latest if not given. Ctrl-C puts the case down; the same
    command takes it up. Exits with 0 when the failure is gone after the last step, and 1 when not.
    """
    from hil.cli.diagnosing import run  # noqa: PLC0415 - help is quick

    run(hand, case)
