"""Announcement of a motion before a hand moves."""

from collections.abc import Sequence

from rich.box import SIMPLE_HEAD
from rich.table import Table

from aero.channels import FINGERS, THUMB, Channel
from aero.printable import capital
from aero.safety import Thresholds
from hil.dialogue.asker import Motion
from hil.targets.hand_spec import PHYSICAL
from hil.targets.target import Target

FULLY = 0.97
"""Threshold of the commanded fraction of a window; from it the text says that a channel closes fully."""


def before_moving(target: Target, furthest: Sequence[float], seconds: float) -> Motion:
    """Return the announcement: moving parts, duration, and stop conditions.

    Nothing is commanded. `furthest` is the fraction of each channel's window that it is sent to at most, (7,), command
    order; `seconds` is hand time, s.

    Raises:
        SafetyStopError: a guarded hand is too hot to move, or holds against something.
    """
    _at_rest(target)
    thresholds = None if target.guard is None else target.guard.thresholds
    return motion(furthest, seconds, thresholds, emulated=target.unit != PHYSICAL)


def motion(
    furthest: Sequence[float], seconds: float, thresholds: Thresholds | None, *, emulated: bool = False
) -> Motion:
    """Return the announcement for a hand with these guard thresholds, or None for an unguarded hand."""
    channels = tuple(channel for channel in Channel if furthest[channel] > 0.0)
    moves = _moves(furthest)
    if not moves:
        return Motion("Nothing will move.", channels, seconds)
    if emulated and thresholds is None:
        return Motion(f"{moves} for about {_rounded(seconds)} s of hand time. The hand is emulated.", channels, seconds)
    text = f"{moves} for about {_rounded(seconds)} s. Keep clear."
    if thresholds is None:
        return Motion(f"{text} This hand is not guarded: nothing stops it.", channels, seconds)
    stop = f"{thresholds.current_a:g} A or {thresholds.temperature_c:g} °C"
    return Motion(f"{text} Ctrl-C opens the hand. It stops at {stop}.", channels, seconds)


def readings(target: Target, furthest: Sequence[float]) -> Table:
    """Return a table of the present readings and the planned range of each channel.

    Raises:
        SafetyStopError: as `before_moving`.
    """
    currents, temperatures = _at_rest(target)
    guarded = "not guarded" if target.guard is None else "guarded"
    shown = Table(
        "Channel", "A", "°C", "will move to", box=SIMPLE_HEAD, title_justify="left",
        title=f"{target.describe()}, {guarded}",
    )  # fmt: skip
    for channel in Channel:
        to = f"{100 * furthest[channel]:.0f} %"
        shown.add_row(channel.label, f"{currents[channel]:+z.2f}", f"{temperatures[channel]:.0f}", to)
    return shown


def _at_rest(target: Target) -> tuple[Sequence[float], Sequence[float]]:
    """Return currents (7,) A and temperatures (7,) °C; for a guarded hand, after the guard's check."""
    if target.guard is None:
        return list(target.hand.read_currents()), list(target.hand.read_temperatures())
    health = target.guard.check()
    return list(health.currents_a), list(health.temperatures_c)


def _moves(furthest: Sequence[float]) -> str:
    """Return the moving parts and their range as text; empty without motion."""
    parts = {
        name: far
        for name, channels in (("fingers", FINGERS), ("thumb", THUMB))
        if (far := max(furthest[channel] for channel in channels)) > 0
    }
    if not parts:
        return ""
    far = max(parts.values())
    how = "close fully" if far >= FULLY else f"close by up to {100 * far:.0f} %"
    names = " and ".join(parts)
    return f"{capital(names)} will {how}"


def _rounded(seconds: float) -> int:
    """Return a rounded duration for display: to 10 s from one minute."""
    return int(round(seconds, -1 if seconds >= 60.0 else 0))
