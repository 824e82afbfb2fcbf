"""Options shared by several commands."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, closing, contextmanager
from functools import update_wrapper
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from aero.clock import WallClock
from aero.exit_code import Exit
from aero.firmware import DEFAULT_FIRMWARE, FIRMWARE
from aero.side import Side
from hil.cli.exits import Ended, usage_errors
from hil.cli.output_files import RECORDED
from hil.dialogue.printing import echo
from hil.targets.hand_spec import PortSpec

if TYPE_CHECKING:
    from hil.recordings.wire_file import WireFile
    from hil.targets.target import Target

AnyFunction = Callable[..., Any]

FAULT_HELP = "`NAME[:CHANNEL][=SEVERITY][@SECONDS]`, repeatable; `aero-hil faults` lists the names."


def open_hand(spec: PortSpec, **fields: Any) -> AbstractContextManager[Target]:
    """Return a hand as a context manager, with `fields` replaced; see `hil.emulated.any_hand.open_any`."""
    from hil.emulated.any_hand import open_any  # noqa: PLC0415 - loads a physics engine
    from hil.emulated.emulated_spec import with_fields  # noqa: PLC0415 - as above

    with usage_errors():
        return _unwound(open_any(with_fields(spec, **fields)))


@contextmanager
def _unwound(opening: AbstractContextManager[Target]) -> Iterator[Target]:
    """Enter a target, and exit it on SIGTERM as on Ctrl-C."""
    from aero.safety import unwinding  # noqa: PLC0415 - help is quick

    with unwinding(), opening as opened:
        yield opened


RECORDING = click.Path(exists=True, dir_okay=False, path_type=Path)
RECORD = click.option(
    "--record", type=RECORDED,
    help="Write the bytes of the program that uses the port to this MCAP file, for `aero-hil report`.",
)  # fmt: skip
"""Option of the commands that serve a port."""


@contextmanager
def link_recorded(path: Path | None, **about: Any) -> Iterator[WireFile | None]:
    """Open the recording of `--record`, None without one; `about` has further arguments of `WireFile`.

    A write error is printed at once, and the command continues to serve the port.

    Raises:
        CannotBeWrittenError: raised on exit after a write error.
    """
    if path is None:
        yield None
        return
    # imported here, because a link without a recording does not need this extra
    from hil.recordings.wire_file import WireFile  # noqa: PLC0415

    with closing(WireFile(path, WallClock(), on_failure=_recording_ended, **about)) as file:
        yield file
    if file.failure is not None:
        raise file.failure


def _recording_ended(error: Exception) -> None:
    echo(f"the recording ends here, the link continues: {error}", err=True)


def _installed(_context: click.Context, _option: click.Parameter, wanted: bool) -> bool:
    """Reject `--view` at once if its extra is not installed."""
    if wanted and find_spec("viser") is None:
        raise Ended("`--view` needs the extra `view`; from a checkout: pip install -e '.[view]'", Exit.USAGE)
    return wanted


VIEW = click.option("--view", is_flag=True, callback=_installed, help="Show the hand in a web page on this machine.")
SEED = click.IntRange(0, 2**32 - 1)
"""Seed range common to NumPy, JAX and the firmware sessions."""


class Finite(click.FloatRange):
    """Number in a range, excluding NaN, which click's own type accepts."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number, or fail with the expected range."""
        number: float = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number", param, ctx)
        return number


class HostAndPort(click.ParamType):  # type: ignore[type-arg]  # generic only from Click 8.2 on
    """Address `HOST:PORT`, or `[HOST]:PORT` for IPv6; port 0 selects any free port."""

    name = "host:port"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, int]:
        """Return host and port, or fail with the expected form."""
        host, colon, port = str(value).rpartition(":")
        if not (host and colon and port.isdigit() and int(port) < 2**16):
            self.fail(f"{value!r} is not HOST:PORT, such as localhost:4000", param, ctx)
        return host.removeprefix("[").removesuffix("]"), int(port)


LONGEST_S = 7 * 86_400.0
"""Longest permitted time, s: a week."""
SECONDS = Finite(0.0, LONGEST_S, min_open=True)


SIDE = click.Choice(["right", "left"])
FIRMWARE_PROGRAM = click.option(
    "--firmware-program",
    type=click.Path(exists=True, dir_okay=False, executable=True, path_type=Path),
    help="Run this program of `aero-hil firmware build` on the emulated board; --firmware is its version.",
)
TARGET = click.option(
    "--hil", "target_name", default="emulated", show_default=True, metavar="TARGET",
    help="`emulated`, `pty`, the path or pyserial URL of a port, or a name in hands.toml.",
)  # fmt: skip


def emulation(command: AnyFunction) -> AnyFunction:
    """Add the options of an emulated hand, passed to the command as one `spec: PortSpec`."""

    def with_hand(*, firmware: str, side: Side, unit: str, seed: int, **others: Any) -> Any:
        from hil.emulated.emulated_spec import named_spec  # noqa: PLC0415 - `guard` runs without the emulated hand

        with usage_errors():
            chosen = named_spec(
                others.pop("target_name", "emulated"),
                firmware=firmware if _asked_for("firmware") else None,
                side=side if _asked_for("side") else None,
                unit=unit,
                seed=seed,
                firmware_program=others.pop("firmware_program", None),
            )
        return command(spec=chosen, **others)

    wrapped: AnyFunction = update_wrapper(with_hand, command)
    decorators = (
        click.option(
            "--firmware",
            type=click.Choice(FIRMWARE),
            default=DEFAULT_FIRMWARE,
            show_default=True,
            help="Firmware version of the hand.",
        ),
        click.option("--side", type=SIDE, default="right", show_default=True, help="Side of the hand."),
        click.option(
            "--unit",
            metavar="UNIT",
            default="reference",
            show_default=True,
            help="Emulated unit: a name, plausible:SEED or a .toml file.",
        ),
        click.option("--seed", type=SEED, default=0, show_default=True, help="Seed of the emulated hand's noise."),
    )
    for decorate in reversed(decorators):
        wrapped = decorate(wrapped)
    return wrapped


def _asked_for(option: str) -> bool:
    """Return whether the command line gives this option, which then overrides `hands.toml`."""
    return click.get_current_context().get_parameter_source(option) is not ParameterSource.DEFAULT


def target(command: AnyFunction) -> AnyFunction:
    """Add `--hil` and the options of an emulated hand."""
    return TARGET(emulation(command))
