"""Command `aero-hil servos`: check servos on their bus, and set them up before a robot is assembled."""

import json
import sys
from collections.abc import Callable, Sequence
from contextlib import closing
from functools import update_wrapper

import click

from aero.clock import WallClock
from aero.exit_code import Exit
from aero.serial_transport import SerialTransport
from feetech_robots.feetech_bus import DamagedAnswerError, FeetechBus, NoAnswerError
from feetech_robots.servo_rules import LARGEST_COUNTS, judge, small_move
from feetech_robots.servo_setup import ServoBusError, ServoSetup, ServoValueError
from feetech_robots.survey import BAUD_RATES, Surveyed, find, survey
from hil.cli.doctor import exit_code, show
from hil.cli.doctor.finding import Examined, Subject, Verdict, worst
from hil.cli.exits import Ended
from hil.dialogue.printing import echo

FORMAT = 1
"""Format version of the `--json` output; changes with any name in the output."""
LARGEST_ID = 253


@click.group()
@click.option("--port", help="Serial port of the bus adapter, for example /dev/ttyUSB0; all but `check` need it here.")
@click.option("--baud", type=int, default=BAUD_RATES[0], show_default=True, help="Baud rate of the servos, bit/s.")
@click.pass_context
def servos(context: click.Context, port: str | None, baud: int) -> None:
    """Check and set up servos on a bus adapter; the hand's own board must be off the bus."""
    context.obj = port, baud


class Ids(click.ParamType):  # type: ignore[type-arg]  # generic only from Click 8.2 on
    """IDs as `1-6` or `1,3,5`."""

    name = "ids"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, ...]:
        """Return the IDs as a tuple."""
        if isinstance(value, tuple):
            return value
        ids: list[int] = []
        try:
            for part in str(value).split(","):
                first, _, last = part.partition("-")
                ids += range(int(first), int(last or first) + 1)
        except ValueError:
            self.fail(f"{value!r} is not a list of IDs such as 1-6 or 1,3,5", param, ctx)
        if not ids or not all(0 <= servo <= LARGEST_ID for servo in ids):
            self.fail(f"IDs are 0 to {LARGEST_ID}", param, ctx)
        return tuple(ids)


@servos.command()
@click.argument("port")
@click.option("--expect", type=Ids(), default=(), help="IDs that must answer, and no others, as 1-6 or 1,3,5.")
@click.option("--ids", type=Ids(), default=tuple(range(LARGEST_ID + 1)), help="IDs to ask; left out: all.")
@click.option("--baud", type=int, help="Baud rate to ask at, bit/s; left out: that of `servos --baud`.")
@click.option("--every-baud", is_flag=True, help="Ask at every baud rate that servos have.")
@click.option(
    "--move", type=click.IntRange(1, LARGEST_COUNTS), metavar="COUNTS", help="Also move each servo by this and back."
)
@click.option("--json", "as_json", is_flag=True, help="Print data for programs and for bug reports.")
def check(
    port: str,
    *,
    expect: Sequence[int],
    ids: Sequence[int],
    baud: int | None,
    every_baud: bool,
    move: int | None,
    as_json: bool,
) -> None:
    """Check every servo that answers at PORT and print remedies; nothing moves without --move."""
    moved: list[Examined] = []
    found: list[Surveyed] = []
    echoes = False
    for rate in BAUD_RATES if every_baud else (baud or click.get_current_context().obj[1],):
        with closing(_opened(port, rate)) as transport:
            bus = FeetechBus(transport)
            here = [survey(bus, servo, rate) for servo in find(bus, ids)]
            found += here
            echoes |= bool(bus.echoes)
            if move is not None:
                moved += [_moved(bus, one, move) for one in here if one.model is not None]
    findings = [*judge(found, expect), *moved] if found else [_no_servo(port, echoes)]
    if as_json:
        document = {"format": FORMAT, "verdict": worst(findings), "findings": [one.as_dict() for one in findings]}
        echo(json.dumps(document, indent=2))
    else:
        for finding in findings:
            show(finding)
    sys.exit(exit_code(findings))


def _no_servo(port: str, echoes: bool) -> Examined:
    said = f"no servo answers at {port}" + ("; the line only echoes what is sent" if echoes else "")
    remedy = "switch the servos' supply on; look at the adapter's mode and the data wire; try --every-baud"
    return Examined("bus", Verdict.WRONG, said, remedy, subject=Subject.LINK)


def _opened(port: str, rate: int) -> SerialTransport:
    try:
        return SerialTransport.open(port, rate)
    except (ConnectionError, ValueError) as error:
        raise Ended(str(error), Exit.NO_HAND) from error


def _moved(bus: FeetechBus, one: Surveyed, counts: int) -> Examined:
    clock = WallClock()
    try:
        return small_move(bus, one, counts, lambda seconds: clock.sleep_until(clock.now() + seconds))
    except (NoAnswerError, DamagedAnswerError) as error:
        return Examined(
            f"servo {one.id} move", Verdict.WRONG, f"it stopped answering: {error}",
            "switch the supply off: its torque may be on", subject=Subject.HAND,
        )  # fmt: skip


def _on_bus(action: Callable[..., None]) -> Callable[..., None]:
    """Open the adapter for a command; a silent or disconnected bus ends with `Exit.NO_HAND`."""

    def command(**arguments: int) -> None:
        port, baud = click.get_current_context().obj
        if port is None:
            raise click.UsageError("name the bus adapter first: aero-hil servos --port PORT ...")
        try:
            with ServoSetup.open(port, baud) as setup:
                action(setup, **arguments)
        except ServoValueError as error:
            raise Ended(str(error), Exit.USAGE) from error
        except (ServoBusError, OSError) as error:
            raise Ended(str(error), Exit.NO_HAND) from error

    return update_wrapper(command, action)


@servos.command()
@_on_bus
def scan(setup: ServoSetup) -> None:
    """List the IDs that answer."""
    found = setup.scan()
    echo(" ".join(map(str, found)) if found else "no servo answers; check power and cable")


@servos.command("show")
@click.argument("servo", type=int)
@_on_bus
def show_servo(setup: ServoSetup, servo: int) -> None:
    """Print the settings and measurements of SERVO."""
    one = setup.read_out(servo)
    rows = {
        "id": one.id,
        "model": f"{one.model} ({one.kind.name})",
        "position_counts": one.position_counts,
        "angle_limits_counts": one.limits_counts,
        "current_limit": "none" if one.current_limit is None else one.current_limit,
        "voltage": one.voltage_v,
        "temperature_c": one.temperature_c,
        "status": one.status,
    }
    for name, value in rows.items():
        echo(f"{name:22} {value}")


@servos.command()
@click.argument("servo", type=int)
@click.argument("new", type=int)
@_on_bus
def set_id(setup: ServoSetup, servo: int, new: int) -> None:
    """Change the ID of SERVO to NEW."""
    setup.set_id(servo, new)
    echo(f"servo {servo} is servo {new} now")


@servos.command()
@click.argument("servo", type=int)
@click.argument("limit", type=int)
@_on_bus
def set_current(setup: ServoSetup, servo: int, limit: int) -> None:
    """Set the protection current of SERVO (register units, the hand needs 1023)."""
    setup.set_current_limit(servo, limit)
    echo(f"servo {servo} protects itself above {limit} units")


@servos.command()
@click.argument("servo", type=int)
@click.argument("low", type=int)
@click.argument("high", type=int)
@_on_bus
def set_angles(setup: ServoSetup, servo: int, low: int, high: int) -> None:
    """Set the angle limits of SERVO (counts; 0 0 removes the limits)."""
    setup.set_angle_limits(servo, low, high)
    echo(f"servo {servo} goes from {low} to {high}")


@servos.command()
@click.argument("servo", type=int)
@_on_bus
def centre(setup: ServoSetup, servo: int) -> None:
    """Make the present position of SERVO 2048 counts."""
    setup.centre(servo)
    echo(f"servo {servo} reads 2048 here")
