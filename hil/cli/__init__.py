"""The `aero-hil` command line. Commands parse, call and print; what they call lives elsewhere."""

from __future__ import annotations

from importlib import import_module

import click

COMMANDS: dict[str, str] = {
    "validate": "hil.cli.validate:validate",
    "report": "hil.cli.recordings:report",
    "replay": "hil.cli.recordings:replay",
    "diff": "hil.cli.recordings:diff",
    "baseline": "hil.cli.recordings:baseline",
    "endurance": "hil.cli.endurance:endurance",
    "emulate": "hil.cli.emulate:emulate",
    "firmware": "hil.cli.firmware:firmware",
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
        command: click.Command = getattr(import_module(module), attribute)
        return command


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="aero-hil")
def main() -> None:
    """Test an Aero Hand Open, real or emulated: its driver, its actuation map and what drives it."""
