"""What a person is shown before a hand moves."""

from __future__ import annotations

from collections.abc import Sequence

from rich.box import SIMPLE_HEAD
from rich.table import Table

from aero.channels import Channel
from aero.safety import Thresholds
from hil.targets.target import Target


def before_moving(target: Target, furthest: Sequence[float]) -> Table:
    """Return what a hand reads now, how far each channel is about to be sent, and what would stop it.

    Args:
        target: the hand; nothing is commanded.
        furthest: (7,) share of each channel's window, command order.

    Raises:
        SafetyStopError: a guarded hand is too hot to move, or holds against something.
    """
    guard = target.guard
    if guard is None:
        currents, temperatures, thresholds = target.hand.read_currents(), target.hand.read_temperatures(), Thresholds()
    else:
        health, thresholds = guard.check(), guard.thresholds
        currents, temperatures = health.currents_a, health.temperatures_c
    stops = ", ".join(f"{name} {value:g}" for name, value in thresholds.as_dict().items())
    shown = Table(
        "Channel", "now, A", "now, °C", "will move to, % of window", box=SIMPLE_HEAD, title_justify="left",
        title=f"{target.describe()}, {'not guarded' if guard is None else 'guarded'}. Thresholds of the guard: {stops}",
    )  # fmt: skip
    for channel in Channel:
        shown.add_row(
            channel.label,
            f"{currents[channel]:+.2f}",
            f"{temperatures[channel]:.0f}",
            f"{100 * furthest[channel]:.0f}",
        )
    return shown
