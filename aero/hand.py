"""A hand, guarded or not, and the way to one on a port: guarded from the first motion to the last."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from aero.actuation import CommandWindow
from aero.clock import WallClock
from aero.driver import AeroHand
from aero.firmware import DEFAULT_FIRMWARE, firmware_of
from aero.safety import GuardedHand, Standby, Thresholds, unwinding
from aero.serial_transport import SerialTransport

Hand = AeroHand | GuardedHand
"""What every experiment moves. `AeroHand` describes each call; `GuardedHand` has the same and says what it adds."""


@contextmanager
def open_hand(
    port_or_url: str,
    *,
    firmware: str = DEFAULT_FIRMWARE,
    calibration: str | None = None,
    hand: str = "right",
    thresholds: Thresholds | None = None,
) -> Iterator[GuardedHand]:
    """Open a hand that starts gently, is watched while it moves, and is left open and weak.

    Use it in a `with` statement. A second process opens it should this one be killed. SIGTERM and SIGHUP end the block
    as Ctrl-C does. Wait on `hand.clock`, which watches meanwhile. `AeroHand.open_unguarded` is for a hand that nothing
    watches.

    Args:
        port_or_url: device path or pyserial URL.
        firmware: version that the hand runs, which no board can report.
        calibration: state of its command windows, `CommandWindow.for_firmware`.
        hand: side, `right` or `left`.
        thresholds: when to stop; the defaults when None.

    Raises:
        ValueError: an unknown firmware, calibration or side.
        ConnectionError: the port cannot be opened; the message says why and which ports there are.
        SafetyStopError: on leaving, the hand may not be open; the message says what to do.
    """
    limits, usual = thresholds or Thresholds(), firmware_of(firmware).settings
    spans = CommandWindow.for_firmware(firmware, calibration, hand).spans_counts()
    with (
        unwinding(),
        GuardedHand(
            SerialTransport.open(port_or_url),
            WallClock(),
            spans_counts=spans,
            usual=usual,
            thresholds=limits,
            standby=Standby(port_or_url, limits, settable=usual is not None),
        ) as guarded,
    ):
        yield guarded
