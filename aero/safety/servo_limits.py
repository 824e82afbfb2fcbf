"""Speed and torque limits of a guarded hand, sent again after a restart or a disturbance."""

import logging
from collections.abc import Iterable
from dataclasses import replace

from numpy.typing import ArrayLike

from aero.channels import THUMB, Channel
from aero.driver import AeroHand
from aero.firmware import ServoSettings
from aero.protocol import make_set_speed, make_set_torque
from aero.safety.thresholds import Thresholds

_LOG = logging.getLogger(__name__)


class ServoLimits:
    """Limits last sent to the board for each channel; empty for a firmware without such settings."""

    def __init__(self, hand: AeroHand, usual: ServoSettings | None, thresholds: Thresholds) -> None:
        """Start empty; `usual` are the firmware's limits, None for a firmware without them.

        Raises:
            ValueError: `usual` out of range.
        """
        if usual is not None:
            make_set_speed(Channel.INDEX, usual.speed)
            make_set_torque(Channel.INDEX, usual.torque)
        self._hand = hand
        self._usual = usual
        self._thresholds = thresholds
        self._settings: dict[Channel, ServoSettings] = {}
        self._disturbances = 0
        self._restarts = 0
        self._unsent = False

    @property
    def settable(self) -> bool:
        """True for a firmware with speed and torque limits."""
        return self._usual is not None

    def of(self, channel: Channel) -> ServoSettings | None:
        """Return a channel's limits, or None."""
        return self._settings.get(channel)

    def begin(self) -> None:
        """Set gentle limits for the first motion, and start counting disturbances of the link."""
        self._disturbances, self._restarts = self._hand.disturbances, self._hand.restarts
        if self._usual is not None:
            gentle = ServoSettings(self._thresholds.gentle_speed, self._thresholds.gentle_torque)
            self._settings = dict.fromkeys(Channel, gentle)
            self._send()

    def weaken(self, channels: Iterable[Channel]) -> None:
        """Set usual limits on all channels, with the torque for end stops on the thumb and `channels`."""
        if self._usual is None:
            return
        weak = {*THUMB, *channels}
        for channel in Channel:
            torque = min(self._usual.torque, self._thresholds.stop_torque) if channel in weak else self._usual.torque
            self._settings[channel] = ServoSettings(self._usual.speed, torque)
        self._send()

    def change(self, channel: Channel, name: str, register_units: int) -> None:
        """Set and store a channel's `speed` or `torque`, register units, of a firmware with limits.

        Raises:
            AeroError, ConnectionError: as `AeroHand.set_speed`; the stored limits are then unchanged.
        """
        before = self._settings
        # Stored before sending, because an interrupt may follow the frame before this method continues.
        self._settings = {**before, channel: replace(before[channel], **{name: register_units})}
        try:
            (self._hand.set_speed if name == "speed" else self._hand.set_torque)(channel, register_units)
        except Exception:
            self._settings = before
            raise

    def restore(self, codes: ArrayLike) -> None:
        """Send the limits again after a disturbance; after a restart also `codes`, so that the board applies them.

        Raises:
            AeroError, ConnectionError: as `AeroHand.set_speed`; the next call retries.
        """
        disturbances, restarts = self._hand.disturbances, self._hand.restarts
        if disturbances == self._disturbances and not self._unsent:
            return
        self._send()
        _LOG.info("%s: speed and torque limits sent again after a disturbance of the link", self._hand.name)
        if restarts != self._restarts:
            self._hand.command_codes(codes)
        self._disturbances, self._restarts = disturbances, restarts

    def _send(self) -> None:
        """Send all limits; after an interruption the next `restore` sends them again."""
        self._unsent = True
        for channel, settings in self._settings.items():
            self._hand.set_speed(channel, settings.speed)
            self._hand.set_torque(channel, settings.torque)
        self._unsent = False
