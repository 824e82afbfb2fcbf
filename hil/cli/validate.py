"""`aero-hil validate`: check of a hand, physical or emulated, against its limits."""

from pathlib import Path
from typing import Any

import click

from hil.cli.options import FAULT_HELP, FIRMWARE_PROGRAM, VIEW, target
from hil.cli.output_files import FOLDER
from hil.targets.hand_spec import PortSpec


class ExperimentName(click.ParamType):  # type: ignore[type-arg]  # generic only from Click 8.2 on
    """Name of an experiment; the valid names are loaded only on use."""

    name = "experiment"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the name, or fail with the valid names."""
        from hil.checks import EXPERIMENTS, LOSSES  # noqa: PLC0415 - loads a physics engine

        if value not in EXPERIMENTS and LOSSES:
            self.fail("\n".join((f"there is no experiment `{value}`;", *LOSSES)), param, ctx)
        return click.Choice(list(EXPERIMENTS)).convert(value, param, ctx)


@click.command()
@target
@FIRMWARE_PROGRAM
@click.option(
    "--only",
    "names",
    multiple=True,
    type=ExperimentName(),
    help="Run only this experiment; may be repeated. Without it, the default ones. An unknown name lists them.",
)
@click.option(
    "--baseline",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Also report regressions from this folder of `aero-hil baseline`.",
)
@click.option(
    "--zeros", type=click.Choice(["homed", "ideal"]), default="homed", show_default=True,
    help="Encoder zeros of an emulated hand: from homing, as on a physical hand, or ideal.",
)  # fmt: skip
@click.option("--fault", "faults", multiple=True, metavar="FAULT", help=f"Inject into an emulated hand: {FAULT_HELP}")
@VIEW
@click.option("--dry-run", is_flag=True, help="Read currents and temperatures, print the planned motion, and stop.")
@click.option(
    "--out", type=FOLDER,
    help="Folder of report, metrics and recordings; default: validation/DATE-AND-TIME.",
)  # fmt: skip
def validate(*, spec: PortSpec, baseline: Path | None, zeros: str, **options: Any) -> None:
    """Check a hand: completeness, motion, agreement with the simulator.

    Recordings are written during the run, so that any ending keeps the results so far. Exit code 0: within
    limits; 1: out of limits; others: no verdict, see "Exit codes" in the documentation.
    """
    from hil.cli.validation_run import run  # noqa: PLC0415 - help is quick

    run(spec, baseline=baseline or spec.baseline, homed=zeros == "homed", **options)
