"""An emulated hand under conditions: the host is late, and another program has left its limits on the board."""

from __future__ import annotations

from random import Random

from aero import AeroHand
from aero.channels import Channel
from aero.clock import Clock
from aero.transport import Transport
from hil.faults.host import Passing
from model.units.conditions import Conditions


class LateHost(Passing):
    """A program that comes to write later than it meant to, each time."""

    def __init__(self, behind: Transport, clock: Clock, late_s: float, random: Random) -> None:
        """Be late by half of `late_s` to all of it (s)."""
        super().__init__(behind)
        self._clock, self._late_s, self._random = clock, late_s, random

    def write(self, data: bytes) -> None:
        """Send all of `data`, late."""
        self._clock.sleep_until(self._clock.now() + self._random.uniform(0.5, 1.0) * self._late_s)
        super().write(data)


def found_as(conditions: Conditions, link: Transport, clock: Clock, *, settable: bool, seed: int) -> Transport:
    """Return the link as a program under conditions has it; limits of an earlier program are on the board then.

    Args:
        conditions: what is found.
        link: to a hand that nothing moves.
        clock: of the hand.
        settable: whether the firmware takes speed and torque limits.
        seed: of the host's lateness.
    """
    earlier = AeroHand(link, clock)
    for channel in Channel if settable else ():
        if conditions.speed is not None:
            earlier.set_speed(channel, conditions.speed)
        if conditions.torque is not None:
            earlier.set_torque(channel, conditions.torque)
    return LateHost(link, clock, conditions.late_s, Random(seed)) if conditions.late_s else link
