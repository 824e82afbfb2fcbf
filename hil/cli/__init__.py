"""The `aero-hil` command line. Commands parse, call and print; the work is in other packages."""

import os
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import click

from aero.exit_code import Exit
from aero_hil_toml import meant
from hil.cli.command_table import Command, brought, commands, find_command, named
from hil.cli.exits import Ended, ctrl_c_exits, run
from hil.cli.logs import log_nowhere, with_log
from hil.cli.missing import is_ours, other_package
from hil.dialogue.printing import echo, survive_closed_streams


class LazyGroup(click.Group):
    """Click group that imports a command's module on demand."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the command names in listing order."""
        return list(commands())

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find a command by name; for an unknown name, suggest the nearest."""
        name = args[0]
        if find_command(name) is None:
            asked = f"There is no command `{name}`; {meant(name, commands())}"
            ctx.fail("\n".join((asked.rstrip("; "), *brought().losses)))
        ctx.meta["help"] = not {"-h", "--help"}.isdisjoint(args)
        return super().resolve_command(ctx, args)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return one command, None for an unknown name.

        Raises:
            Ended: what it imports is not installed.
        """
        row = find_command(cmd_name)
        if row is None:
            return None
        try:
            command = _imported(row)
        except ImportError as error:
            if is_ours(error.name) or other_package(error):
                raise
            if not is_ours(row.place):
                raise Ended(f"`aero-hil {cmd_name}` of another package: {named(error)}", Exit.USAGE) from error
            needs = (
                f"`aero-hil {cmd_name}` needs the extra `{row.extra}`; from a checkout: pip install -e '.[{row.extra}]'"
            )
            if ctx is not None and ctx.meta.get("help"):
                echo(f"{row.summary} {needs}")
                ctx.exit()
            raise Ended(f"{needs} ({error})", Exit.USAGE) from error
        return with_log(command)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands from their tables, without imports."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, row.summary) for name, row in commands().items()])
        for line in brought().losses:
            formatter.write(f"{line}\n")

    def main(self, *arguments: Any, **settings: Any) -> Any:
        """Run the command line and end the program with the exit code of its ending."""
        _name_drawing_library()
        # A notebook's MPLBACKEND names a backend of its own kernel, which fails elsewhere; figures here are files.
        os.environ["MPLBACKEND"] = "agg"
        survive_closed_streams()
        log_nowhere()
        run(
            lambda: super(LazyGroup, self).main(
                *arguments, **{"prog_name": "aero-hil", **settings, "standalone_mode": False}
            )
        )


def _imported(row: Command) -> click.Command:
    module, attribute = row.place.split(":")
    with ctrl_c_exits():
        command: click.Command = getattr(import_module(module), attribute)
    return command


GLFW_LIBRARY = "PYGLFW_LIBRARY"


def _name_drawing_library() -> None:
    """Set `PYGLFW_LIBRARY` to the library that `glfw` ships, unless it is set; child processes inherit the setting.

    To be called before MuJoCo is imported.
    """
    # By default, glfw starts another Python for each library that it finds. If the command is killed meanwhile, that
    # process prints a traceback.
    found = find_spec("glfw")
    if found is None or GLFW_LIBRARY in os.environ:
        return
    variant = "wayland" if os.environ.get("XDG_SESSION_TYPE") == "wayland" else "x11"
    for folder in found.submodule_search_locations or ():
        library = Path(folder, variant, "libglfw.so")
        if library.is_file():
            os.environ[GLFW_LIBRARY] = str(library)


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="aero-hil")
def main() -> None:
    """Test an Aero Hand Open, physical or emulated: hand, firmware, driver, actuation map and policy."""
