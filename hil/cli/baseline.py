"""`aero-hil baseline`: stored figures of one hand."""

from pathlib import Path

import click

from hil.cli.exits import usage_errors
from hil.cli.output_files import FOLDER
from hil.dialogue.printing import echo
from hil.verdict import baseline as baselines


@click.command()
@click.argument("results", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.argument("folder", type=FOLDER)
@click.option("--force", is_flag=True, help="Accept a run that did not pass.")
def baseline(*, results: Path, folder: Path, force: bool) -> None:
    """Store the figures of RESULTS, a folder of `validate`, as the baseline FOLDER of one hand.

    A run that did not pass is refused. `aero-hil validate --baseline FOLDER` reports regressions from the baseline.
    """
    with usage_errors():
        FOLDER.distinct(folder)
        baselines.store(results, folder, force=force)
    echo(f"baseline {folder}; compare with `aero-hil validate --baseline {folder}`")
