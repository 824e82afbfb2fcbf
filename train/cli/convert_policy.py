"""`aero-hil convert-policy`: conversion of a Brax or MuJoCo Playground checkpoint to a policy file."""

from __future__ import annotations

from pathlib import Path

import click

from aero.policy.file import save
from aero.policy.settings import PRESETS
from aero.policy.task import ShownAction
from hil.cli.exits import usage_errors
from hil.cli.output import echo
from hil.recordings.output import prepared_file
from train.convert import convert


@click.command("convert-policy")
@click.argument("checkpoint", type=click.Path(exists=True, path_type=Path))
@click.argument("policy", type=click.Path(dir_okay=False, path_type=Path))
@click.option(
    "--settings", type=click.Choice(list(PRESETS)), default="training", show_default=True,
    help="Nominal grasp and scales it was trained with, as a preset of the paper's.",
)  # fmt: skip
@click.option(
    "--shown-action", type=click.Choice([shown.value for shown in ShownAction]), default="before_last",
    show_default=True, help="Action that its observation shows; the released environment shows `before_last`.",
)  # fmt: skip
def convert_policy(*, checkpoint: Path, policy: Path, settings: str, shown_action: str) -> None:
    """Turn CHECKPOINT, Brax PPO parameters of the cube task, into the file POLICY.

    CHECKPOINT is a pickle, as the released one, or a folder that Orbax wrote, as Brax does today. Nothing in a pickle
    is run: what it names beyond the few classes of such a checkpoint is refused. Folders need the `train` extra.
    """
    with usage_errors():
        prepared_file(policy)
        converted = convert(checkpoint, PRESETS[settings], ShownAction(shown_action))
    save(converted, policy)
    echo(f"{policy}: {converted.name}, observes the action {shown_action}, {settings} settings")
