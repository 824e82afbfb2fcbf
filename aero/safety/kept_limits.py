"""Speed and torque limits of a guarded hand, sent again when its board may have lost them."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from dataclasses import replace

from numpy.typing import ArrayLike

from aero.channels import THUMB, Channel
from aero.driver import AeroHand
from aero.firmware import ServoSettings
from aero.safety.thresholds import Thresholds

_LOG = logging.getLogger(__name__)


class KeptLimits:
    """What the board was told last about each channel. It holds nothing for a firmware without such settings."""

    def __init__(self, hand: AeroHand, usual: ServoSettings | None, thresholds: Thresholds) -> None:
        """Hold nothing yet; `usual` are the firmware's own limits, None where it has none."""
        self._hand = hand
        self._usual = usual
        self._thresholds = thresholds
        self._settings: dict[Channel, ServoSettings] = {}
        self._disturbances = 0
        self._restarts = 0

    @property
    def settable(self) -> bool:
        """Whether the firmware has speed and torque limits."""
        return self._usual is not None

    def of(self, channel: Channel) -> ServoSettings | None:
        """Return a channel's limits, None when there are none."""
        return self._settings.get(channel)

    def begin(self) -> None:
        """Make all channels slow and weak, for the first motion; disturbances of the link count from now on."""
        self._disturbances, self._restarts = self._hand.disturbances, self._hand.restarts
        if self._usual is not None:
            gentle = ServoSettings(self._thresholds.gentle_speed, self._thresholds.gentle_torque)
            self._settings = dict.fromkeys(Channel, gentle)
            self._send()

    def weaken(self, channels: Iterable[Channel]) -> None:
        """Give all channels their usual limits, and the thumb and `channels` the torque that a stop may get."""
        if self._usual is None:
            return
        weak = {*THUMB, *channels}
        for channel in Channel:
            torque = min(self._usual.torque, self._thresholds.stop_torque) if channel in weak else self._usual.torque
            self._settings[channel] = ServoSettings(self._usual.speed, torque)
        self._send()

    def note(self, channel: Channel, **changed: int) -> None:
        """Take over a limit that was sent: `speed` or `torque`, register units."""
        if self._usual is not None:
            self._settings[channel] = replace(self._settings[channel], **changed)

    def restore(self, codes: ArrayLike) -> None:
        """Send the limits again after a disturbance; after a restart also `codes`, with which the board applies them.

        Raises:
            AeroError, ConnectionError: as `AeroHand.set_speed`; the next call tries again.
        """
        disturbances, restarts = self._hand.disturbances, self._hand.restarts
        if disturbances == self._disturbances:
            return
        self._send()
        _LOG.info("%s: speed and torque limits sent again after a disturbance of the link", self._hand.name)
        if restarts != self._restarts:
            self._hand.command_codes(codes)
        self._disturbances, self._restarts = disturbances, restarts

    def _send(self) -> None:
        """Send all limits, whatever the board has."""
        for channel, settings in self._settings.items():
            self._hand.set_speed(channel, settings.speed)
            self._hand.set_torque(channel, settings.torque)
