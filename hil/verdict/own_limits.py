"""Speed and torque limits while a hand is judged: the firmware's own, whatever another program has left."""

from __future__ import annotations

from contextlib import suppress

from aero.channels import Channel
from aero.errors import AeroError
from aero.firmware import firmware_of
from aero.protocol import Opcode
from aero.safety import SafetyStopError
from hil.targets.target import Target


class OwnLimits:
    """Gives a board its firmware's own limits, and gives back those that this program had set before.

    A board does not tell its limits. So those that another program has left are replaced for good, as a restart of the
    board would do. A guarded hand has its limits from its guard.
    """

    def __init__(self, target: Target) -> None:
        """Look what this program has set; nothing is sent yet."""
        self._hand = target.hand
        self._before = target.hand.settings_sent
        self._own = None if target.guard is not None else firmware_of(target.firmware).settings
        self._asked = self._set = False

    def set(self) -> None:
        """Set the firmware's own limits, at the first call; the board applies them with the next command.

        A board that knows no limits runs an older firmware than was said, which what follows shows.

        Raises:
            AeroError, ConnectionError: as `AeroHand.set_speed`.
        """
        if self._asked:
            return
        self._asked = True
        if self._own is None or not self._hand.knows_limits():
            return
        self._set = True
        for channel in Channel:
            self._hand.set_speed(channel, self._own.speed)
            self._hand.set_torque(channel, self._own.torque)

    def give_back(self) -> None:
        """Set again what this program had set before; a hand that can no longer be reached is left as it is."""
        with suppress(AeroError, SafetyStopError, OSError):
            for (opcode, channel), value in self._before.items() if self._set else ():
                (self._hand.set_speed if opcode is Opcode.SET_SPE else self._hand.set_torque)(channel, value)
