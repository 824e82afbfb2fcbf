"""The `aero-hil` command line. Commands parse, call and print; the work is in other packages."""

from __future__ import annotations

import os
from difflib import get_close_matches
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import click

from hil.cli.exits import OURS, Ended, Exit, ctrl_c_exits, run
from hil.cli.logs import log_nowhere, with_log


class Command(NamedTuple):
    """One command; its module is imported only when it is used."""

    place: str
    """`module:attribute`."""
    summary: str
    """Its line in the list of commands."""
    extra: str = "hil"
    """Extra that its imports come with."""


COMMANDS: dict[str, Command] = {
    "doctor": Command("hil.cli.doctor:doctor", "Look at this machine and a hand at rest, and say what to do."),
    "validate": Command("hil.cli.validate:validate", "Check a hand, real or emulated, against its limits."),
    "report": Command("hil.cli.report:report", "Judge recordings again and write the report."),
    "view": Command("hil.cli.view:view", "Play a recording in a web page.", "view"),
    "export": Command("hil.cli.export:export_command", "Write a recording for Foxglove.", "foxglove"),
    "replay": Command("hil.cli.replay:replay", "Send the bytes of a recording to a hand again."),
    "baseline": Command("hil.cli.baseline:baseline", "Store a hand's figures, to compare with later."),
    "campaign": Command("train.cli.campaign:campaign", "Validate many emulated hands, healthy and faulty.", "campaign"),
    "limits": Command("train.cli.limits:limits", "Compute limits from the healthy hands of a campaign.", "campaign"),
    "emulate": Command("hil.cli.emulate:emulate", "Serve an emulated hand on a port.", "emulate"),
    "emulate-bus": Command("hil.cli.emulate_bus:emulate_bus", "Serve any robot of bus servos on a port.", "emulate"),
    "faults": Command(
        "hil.cli.faults:faults", "List the faults that can be injected into a hand or a link.", "emulate"
    ),
    "proxy": Command("hil.cli.proxy:proxy", "Inject faults between a program and a port.", "emulate"),
    "firmware": Command("hil.cli.firmware:firmware", "Build a firmware of your own, and compare two."),
    "servos": Command("hil.cli.servos:servos", "Check servos on a bus adapter, and set them up."),
    "calibrate": Command("train.cli.calibrate:calibrate_command", "Fit a unit to recordings of a hand."),
    "score": Command("train.cli.score:score_command", "Score a unit against recordings of a hand."),
    "record": Command("train.cli.record:record_command", "Excite a hand and record what calibration needs."),
    "train": Command("train.cli.train:train", "Train a policy."),
    "evaluate": Command("train.cli.evaluate:evaluate", "Measure a policy on emulated hands with a cube."),
    "run-policy": Command("hil.cli.run_policy:run_policy", "Run a policy on a hand."),
    "convert-policy": Command("train.cli.convert_policy:convert_policy", "Turn a Brax checkpoint into a policy file."),
}


class LazyGroup(click.Group):
    """A click group that imports a command's module when it is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the command names in the order of `COMMANDS`."""
        return list(COMMANDS)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command that is asked for; one that is misspelt is answered with the nearest."""
        name = args[0]
        if name not in COMMANDS and (close := get_close_matches(name, COMMANDS, 1)):
            ctx.fail(f"There is no command `{name}`. Did you mean `{close[0]}`?")
        ctx.meta["help"] = not {"-h", "--help"}.isdisjoint(args)
        return super().resolve_command(ctx, args)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return one command, None for an unknown name.

        Raises:
            Ended: what it imports is not installed, and more than its help is wanted.
        """
        if cmd_name not in COMMANDS:
            return None
        module, attribute = COMMANDS[cmd_name].place.split(":")
        try:
            with ctrl_c_exits():
                command: click.Command = getattr(import_module(module), attribute)
        except ImportError as error:
            if (error.name or "").partition(".")[0] in OURS:
                raise
            extra = COMMANDS[cmd_name].extra
            needs = f"`aero-hil {cmd_name}` needs the extra `{extra}`; from a checkout: pip install -e '.[{extra}]'"
            if ctx is None or not ctx.meta.get("help"):
                raise Ended(f"{needs} ({error})", Exit.USAGE) from error
            from hil.cli.placeholders import placeholders  # noqa: PLC0415 - of use to few, and other help is quick

            with placeholders(OURS):
                command = getattr(import_module(module), attribute)
            command.epilog = needs
        return with_log(command)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands from the table, so that help imports none of them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, row.summary) for name, row in COMMANDS.items()])

    def main(self, *arguments: Any, **settings: Any) -> Any:
        """Run the command line and end the program, with the exit code that its ending asks for."""
        _name_drawing_library()
        log_nowhere()
        run(lambda: super(LazyGroup, self).main(*arguments, **{**settings, "standalone_mode": False}))


GLFW_LIBRARY = "PYGLFW_LIBRARY"


def _name_drawing_library() -> None:
    """Name the library that MuJoCo draws with, where `glfw` brings one and none is named; other processes inherit it.

    To be called before MuJoCo is imported.
    """
    # Left alone, glfw starts Python once more for each library that it finds. When a command is killed meanwhile, that
    # second process leaves a traceback.
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
    """Test an Aero Hand Open, real or emulated: its driver, its actuation map and what drives it."""
