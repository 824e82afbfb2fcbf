"""`python -m examples.centre CHANNEL...`: the maker's procedure for a channel whose travel does not fit its window."""

from dataclasses import dataclass

import click
import numpy as np

import hil
from aero.channels import Channel
from aero.protocol import MAX_CODE, Opcode
from aero.safety.opening import move_slowly
from aero.side import Side
from hil.dialogue.asker import Question
from hil.dialogue.terminal import console
from hil.dialogue.terminal_asker import TerminalAsker
from hil.targets.target import Target

LABELS = tuple(channel.label for channel in Channel)
WINDOW_S = 4.0
"""Time in which a channel is moved through its whole window, s."""
LOOK_S = 0.3
"""Time after a motion before the hand is read, s."""

DONE = "done"
"""Word that ends the approach to a position; Enter alone could be one too many."""


@dataclass(frozen=True)
class Number(Question[float | None]):
    """Question for a number in a range; None once the person is done."""

    low: float
    high: float

    def read(self, line: str) -> float | None:
        """Return the number, None for `DONE`."""
        if line.strip() == DONE:
            return None
        try:
            number = float(line)
        except ValueError:
            number = float("nan")
        if not self.low <= number <= self.high:
            raise ValueError(f"  {line.strip()!r} is no number from {self.low:g} to {self.high:g}; or type {DONE!r}")
        return number

    def line(self, answer: float | None) -> str:
        """Return the number as text."""
        return DONE if answer is None else str(answer)


TO_THE_MIDDLE = Number(f"  per cent of the window to go to; {DONE!r} when it stands in the middle", 0.0, 100.0)
TO_THE_OPEN_END = Number(
    f"  degrees of the servo to move the open end by, + opens further; {DONE!r} when it is open", -360.0, 360.0
)


@click.command("centre")
@click.argument("channels", nargs=-1, required=True, type=click.Choice(LABELS))
@click.option("--hil", "place", default="emulated", show_default=True, help="Port of the hand, or `emulated`.")
@click.option("--side", type=click.Choice(["right", "left"]), default="right", show_default=True)
@click.option("--firmware", default="main", show_default=True)
def centre(*, place: str, side: Side, firmware: str, channels: tuple[str, ...]) -> None:
    """Centre CHANNELS of a hand that runs firmware `main`, one after the other: CALIBRATE_MID, then TRIM.

    For a finger whose cable is longer, shorter or wound otherwise than most, so that its travel does not fit the
    window that homing leaves. You bring the finger to the middle of its travel; there its servo is made to read 2048
    counts. Then you trim the open end. The hand is guarded, slow and weak meanwhile. The next homing replaces it all:
    with this firmware, that is the next time the supply is switched on.
    """
    emulated = place == "emulated"
    opening = (
        hil.emulate(firmware=firmware, side=side, guarded=True)
        if emulated
        else hil.open_port(place, firmware=firmware, side=side)
    )
    with opening as opened:
        if not opened.hand.knows(Opcode.CALIBRATE_MID):
            raise click.UsageError(
                f"{opened.port}: this board does not know CALIBRATE_MID, so it runs 0.2.0 or earlier; flash the main "
                "branch of July 2026 or later"
            )
        opened.begin()
        asker = TerminalAsker(console())
        for label in channels:
            _lead_through(opened, Channel[label.upper()], asker)


def _lead_through(opened: Target, channel: Channel, asker: TerminalAsker) -> None:
    guard = opened.guard
    assert guard is not None
    guard.set_speed(channel, guard.thresholds.gentle_speed)
    guard.set_torque(channel, guard.thresholds.gentle_torque)
    click.echo(f"{channel.label}: bring it to the middle of its travel.")
    while (percent := asker.ask(TO_THE_MIDDLE)) is not None:
        _go(opened, channel, round(percent / 100.0 * MAX_CODE))
        click.echo(f"  it stands at {_share(opened, channel):.0%}")
    centred = guard.calibrate_mid(channel)
    click.echo(
        f"  its servo reads {centred.position_counts} counts here, "
        + ("near the middle of 2048" if centred.near_middle else "NOT near the middle of 2048: do it again")
    )
    click.echo("  The same command means another angle from now on. It goes to its open end, slowly.")
    _go(opened, channel, 0)
    # Counts rise towards the open end of a right hand's fingers, and fall towards that of a left hand's.
    window = opened.map.window
    opening = int(np.sign(window.extend_counts[channel] - window.grasp_counts[channel]))
    while (degrees := asker.ask(TO_THE_OPEN_END)) is not None:
        trimmed = guard.trim(channel, opening * round(degrees))
        _go(opened, channel, 0)
        where = "" if trimmed.position_counts is None else f"; the servo stood at {trimmed.position_counts}"
        click.echo(f"  the open end is at {trimmed.extend_counts} of 0..4095 counts{where}")
    opened.begin()
    click.echo(f"{channel.label}: done")


def _go(opened: Target, channel: Channel, code: int) -> None:
    codes = opened.hand.read_codes()
    goal = codes.copy()
    goal[channel] = code
    move_slowly(opened.hand.command_codes, opened.clock, codes, goal, WINDOW_S)
    opened.clock.sleep_until(opened.clock.now() + LOOK_S)


def _share(opened: Target, channel: Channel) -> float:
    return float(opened.hand.read_codes()[channel]) / MAX_CODE


if __name__ == "__main__":
    centre()
