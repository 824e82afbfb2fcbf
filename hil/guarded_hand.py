"""A driver that watches the hand while it commands it, and that leaves it open and limp however it is left.

On by default for every hand on a port.
"""

from __future__ import annotations

from types import TracebackType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero import AeroHand
from aero.channels import Channel
from aero.clock import Clock
from aero.errors import AeroError
from aero.transport import Transport
from hil.safety import SafetyLimits, SafetyMonitor

NO_SPEED_LIMIT = 32766
"""Speed setting of a board that has just started, register units."""
HOMING_TIMEOUT_S = 200.0
"""As the driver's own: firmware 0.1.2 takes 194 s when every search times out."""


class SafetyAbortError(AeroError):
    """The watch ended an experiment; the hand has been opened. The message says what was seen on which channel."""


class GuardedHand(AeroHand):
    """An `AeroHand` under the watch of a `SafetyMonitor`.

    From the first command on, torque is limited, and for a while speed; readings are looked at whenever commands are
    sent; leaving its `with` block, by whatever way, opens the hand slowly and takes its torque down.
    """

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        *,
        spans: NDArray[np.int64],
        limits: SafetyLimits | None = None,
        settings: bool = True,
    ) -> None:
        """Wrap an open transport.

        Args:
            transport: the bytes' way to the board.
            clock: what tells the time and is waited on.
            spans: (7,) servo counts of each channel's command window.
            limits: the thresholds.
            settings: whether the firmware knows torque limits (`pre` does not; then there are none).
        """
        super().__init__(transport, clock)
        self.limits = limits or SafetyLimits()
        self._time = clock
        self._settings = settings
        self._spans = spans
        self._monitor = SafetyMonitor(self.limits, spans)
        self._looked = -np.inf
        self._moved = False
        self._leaving = False
        self._gentle_until = np.inf

    def command_codes(self, codes: ArrayLike) -> None:
        """Send a command as `AeroHand` does, after a look at the hand when one is due.

        Raises:
            SafetyAbortError: a threshold was passed; the hand has been opened.
        """
        if not self._moved:
            self._limit_torque(self.limits.torque_units)
            self._limit_speed(self.limits.gentle_units)
            self._gentle_until = self._time.now() + self.limits.gentle_s
            self._moved = True
        elif self._time.now() > self._gentle_until:
            self._limit_speed(NO_SPEED_LIMIT)
            self._gentle_until = np.inf
        if self._time.now() - self._looked >= self.limits.watch_s and not self._leaving:
            self._look()
        super().command_codes(codes)
        self._monitor.commanded(self._time.now(), np.asarray(codes, float))

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if self._moved and not isinstance(error, ConnectionError):
                self.retreat()
        finally:
            super().__exit__(kind, error, trace)

    def home(self, timeout_s: float = HOMING_TIMEOUT_S) -> None:
        """Home as `AeroHand` does, by the firmware's own torque limits; the watch starts afresh with the new zero."""
        self._moved = True
        super().home(timeout_s)
        self._monitor = SafetyMonitor(self.limits, self._spans)
        self._limit_torque(self.limits.torque_units)

    def retreat(self) -> None:
        """Open the hand slowly from where it is, and leave it with little torque."""
        self._leaving = True
        start = self.read_codes().astype(float)
        steps = max(1, round(self.limits.open_s / self.limits.watch_s))
        for step in range(1, steps + 1):
            self._time.sleep_until(self._time.now() + self.limits.watch_s)
            self.command_codes(np.round(start * (1 - step / steps)).astype(int))
        self._limit_torque(self.limits.limp_units)
        self.command_codes(np.zeros(len(Channel), int))
        self._leaving = False
        self._moved = False

    def _look(self) -> None:
        self._looked = self._time.now()
        reason = self._monitor.look(
            self._looked, self.read_codes().astype(float), self.read_currents(), self.read_temperatures()
        )
        if reason is not None:
            self.retreat()
            raise SafetyAbortError(f"{self.name}: stopped and opened the hand: {reason}")

    def _limit_speed(self, register_units: int) -> None:
        if self._settings:
            for channel in Channel:
                self.set_speed(channel, register_units)

    def _limit_torque(self, register_units: int) -> None:
        if self._settings:
            for channel in Channel:
                self.set_torque(channel, register_units)
