"""The `aero-hil` command line. Commands parse, call and print; what they call lives elsewhere."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import click

from aero.safety import unwinding
from hil.cli.exits import run

COMMANDS: dict[str, str] = {
    "validate": "hil.cli.validate:validate",
    "report": "hil.cli.report:report",
    "replay": "hil.cli.replay:replay",
    "diff": "hil.cli.diff:diff",
    "baseline": "hil.cli.baseline:baseline",
    "endurance": "hil.cli.endurance:endurance",
    "emulate": "hil.cli.emulate:emulate",
    "map": "hil.cli.map:map_command",
    "identify": "hil.cli.identify:identify_command",
    "servos": "hil.cli.servos:servos",
    "calibrate": "hil.cli.calibrate:calibrate_command",
    "record": "hil.cli.record:record_command",
    "train": "hil.cli.train:train",
    "evaluate": "hil.cli.evaluate:evaluate",
    "run-policy": "hil.cli.run_policy:run_policy",
    "convert-policy": "hil.cli.convert_policy:convert_policy",
}
"""Command name to `module:attribute`; a module is imported only when its command is used."""
EXTRAS = {"emulate": "emulate", "servos": "servo"}
"""Extra that a command's imports come with, where it is not `hil`."""
OURS = ("aero", "firmware_emulator", "model", "hil", "train")


class LazyGroup(click.Group):
    """A click group that imports a command's module when it is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the command names in the order of `COMMANDS`."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return one command, None for an unknown name."""
        if cmd_name not in COMMANDS:
            return None
        module, attribute = COMMANDS[cmd_name].split(":")
        try:
            command: click.Command = getattr(import_module(module), attribute)
        except ImportError as error:
            if (error.name or "").partition(".")[0] in OURS:
                raise
            return _lacking(cmd_name, error)
        return command

    def main(self, *arguments: Any, **settings: Any) -> Any:
        """Run the command line and end the program, with the exit code that its ending asks for."""
        with unwinding():
            run(lambda: super(LazyGroup, self).main(*arguments, **{**settings, "standalone_mode": False}))


def _lacking(name: str, error: ImportError) -> click.Command:
    """Return what stands for a command whose extra is not installed, so that help still lists it."""
    extra = EXTRAS.get(name, "hil")
    needs = f"needs the extra `{extra}`"

    @click.command(
        name, short_help=f"({needs})", context_settings={"ignore_unknown_options": True}, add_help_option=False
    )
    @click.argument("arguments", nargs=-1, type=click.UNPROCESSED, expose_value=False)
    def command() -> None:
        raise click.ClickException(f"`aero-hil {name}` {needs}; from a checkout: pip install -e '.[{extra}]' ({error})")

    return command


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="aero-hil")
def main() -> None:
    """Test an Aero Hand Open, real or emulated: its driver, its actuation map and what drives it."""
