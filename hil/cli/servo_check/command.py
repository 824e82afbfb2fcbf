"""`aero-hil servos check`: the command."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from contextlib import closing

import click

from aero.clock import WallClock
from aero.feetech_bus import DamagedAnswerError, FeetechBus, NoAnswerError
from aero.serial_transport import SerialTransport
from hil.cli.doctor import exit_code, show
from hil.cli.doctor.finding import Examined, Subject, Verdict, worst
from hil.cli.exits import Ended, Exit
from hil.cli.servo_check.rules import judge
from hil.cli.servo_check.small_move import LARGEST_COUNTS, small_move
from hil.cli.servo_check.survey import BAUD_RATES, Surveyed, find, survey

FORMAT = 1
"""Number of the shape that `--json` prints; another one when a name in it changes."""
LARGEST_ID = 253


class Ids(click.ParamType):  # type: ignore[type-arg]  # generic only from Click 8.2 on
    """IDs as `1-6` or `1,3,5`."""

    name = "ids"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, ...]:
        """Return them as a tuple."""
        if isinstance(value, tuple):
            return value
        ids: list[int] = []
        try:
            for part in str(value).split(","):
                first, _, last = part.partition("-")
                ids += range(int(first), int(last or first) + 1)
        except ValueError:
            self.fail(f"{value!r} is no list of IDs such as 1-6 or 1,3,5", param, ctx)
        if not ids or not all(0 <= servo <= LARGEST_ID for servo in ids):
            self.fail(f"IDs are 0 to {LARGEST_ID}", param, ctx)
        return tuple(ids)


@click.command()
@click.argument("port")
@click.option("--expect", type=Ids(), default=(), help="IDs that must answer, as 1-6 or 1,3,5.")
@click.option("--ids", type=Ids(), default=tuple(range(LARGEST_ID + 1)), help="IDs to ask; left out: all.")
@click.option("--baud", type=int, default=BAUD_RATES[0], show_default=True, help="Baud rate to ask at, bit/s.")
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
    baud: int,
    every_baud: bool,
    move: int | None,
    as_json: bool,
) -> None:
    """Look at every servo that answers at PORT, and say what to do; nothing moves without --move."""
    findings: list[Examined] = []
    found: list[Surveyed] = []
    for rate in BAUD_RATES if every_baud else (baud,):
        with closing(_opened(port, rate)) as transport:
            bus = FeetechBus(transport)
            here = [survey(bus, servo, rate) for servo in find(bus, ids)]
            found += here
            if move is not None:
                findings += [_moved(bus, one, move) for one in here if one.model is not None]
    findings[:0] = judge(found, expect)
    if not found:
        findings = [
            Examined(
                "bus",
                Verdict.WRONG,
                f"no servo answers at {port}",
                "switch the servos' supply on; look at the adapter's mode and the data wire; try --every-baud",
                subject=Subject.LINK,
            )
        ]
    if as_json:
        document = {"format": FORMAT, "verdict": worst(findings), "findings": [one.as_dict() for one in findings]}
        click.echo(json.dumps(document, indent=2))
    else:
        for finding in findings:
            show(finding)
    sys.exit(exit_code(findings))


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
