"""`aero-hil servos`: set up real servos on their bus, before a hand is assembled."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from functools import update_wrapper

import click

from aero.servo_bus import ServoBusError, ServoSetup, ServoValueError
from hil.cli.exits import Ended, Exit
from hil.cli.servo_check.command import check


@click.group()
@click.option("--port", help="Serial port of the bus adapter, for example /dev/ttyUSB0; all but `check` need it here.")
@click.pass_context
def servos(context: click.Context, port: str | None) -> None:
    """Check and set up servos on a bus adapter; the hand's own board must be off the bus."""
    context.obj = port


servos.add_command(check)


def _on_bus(action: Callable[..., None]) -> Callable[..., None]:
    """Open the adapter for a command; a bus that does not answer, or is gone, ends with `Exit.NO_HAND`."""

    def command(**arguments: int) -> None:
        port = click.get_current_context().obj
        if port is None:
            raise click.UsageError("name the bus adapter first: aero-hil servos --port PORT ...")
        try:
            with ServoSetup(port) as setup:
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
    click.echo(" ".join(map(str, found)) if found else "no servo answers; check power and cable")


@servos.command()
@click.argument("servo", type=int)
@_on_bus
def show(setup: ServoSetup, servo: int) -> None:
    """Print what a servo says about itself."""
    readout = setup.read_out(servo)
    for field in fields(readout):
        click.echo(f"{field.name:22} {getattr(readout, field.name)}")


@servos.command()
@click.argument("servo", type=int)
@click.argument("new", type=int)
@_on_bus
def set_id(setup: ServoSetup, servo: int, new: int) -> None:
    """Give SERVO the ID NEW."""
    setup.set_id(servo, new)
    click.echo(f"servo {servo} is servo {new} now")


@servos.command()
@click.argument("servo", type=int)
@click.argument("limit", type=int)
@_on_bus
def set_current(setup: ServoSetup, servo: int, limit: int) -> None:
    """Set the protection current of SERVO (register units, the hand needs 1023)."""
    setup.set_current_limit(servo, limit)
    click.echo(f"servo {servo} protects itself above {limit} units")


@servos.command()
@click.argument("servo", type=int)
@click.argument("low", type=int)
@click.argument("high", type=int)
@_on_bus
def set_angles(setup: ServoSetup, servo: int, low: int, high: int) -> None:
    """Set the range of goals of SERVO (counts; 0 0 takes the limits away)."""
    setup.set_angle_limits(servo, low, high)
    click.echo(f"servo {servo} goes from {low} to {high}")


@servos.command()
@click.argument("servo", type=int)
@_on_bus
def centre(setup: ServoSetup, servo: int) -> None:
    """Make the present position of SERVO 2048."""
    setup.centre(servo)
    click.echo(f"servo {servo} reads 2048 here")
