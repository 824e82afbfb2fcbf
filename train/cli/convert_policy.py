"""`aero-hil convert-policy`: conversion of a Brax or MuJoCo Playground checkpoint to a policy file."""

from pathlib import Path

import click

from aero.policy.file import save
from aero.policy.settings import PRESETS
from aero.policy.task import ShownAction
from hil.cli.exits import usage_errors
from hil.cli.output_files import POLICY
from hil.dialogue.printing import echo
from train.convert import convert


@click.command("convert-policy")
@click.argument("checkpoint", type=click.Path(exists=True, path_type=Path))
@click.argument("policy", type=POLICY)
@click.option(
    "--settings", type=click.Choice(list(PRESETS)), default="training", show_default=True,
    help="Nominal grasp and action scales: the paper's for training or for deployment.",
)  # fmt: skip
@click.option(
    "--shown-action", type=click.Choice([shown.value for shown in ShownAction]), default="before_last",
    show_default=True, help="Past action in the observation; `before_last` as in the released environment.",
)  # fmt: skip
def convert_policy(*, checkpoint: Path, policy: Path, settings: str, shown_action: str) -> None:
    """Convert CHECKPOINT, Brax PPO parameters of the cube task, to the policy file POLICY.

    CHECKPOINT is a pickle, like the released one, or a folder of Orbax, as written by current versions of Brax. No code
    of a pickle is executed: names other than the few classes of such a checkpoint are refused. Folders require the
    extra `train`.
    """
    with usage_errors():
        POLICY.prepared(policy)
        converted = convert(checkpoint, PRESETS[settings], ShownAction(shown_action))
    save(converted, policy)
    echo(f"{policy}: {converted.name}, observes the action {shown_action}, {settings} settings")
