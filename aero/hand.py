"""Hand type for experiments, and `open_hand` for a guarded hand on a port."""

from collections.abc import Iterator
from contextlib import contextmanager

from aero.actuation import CommandWindow
from aero.clock import WallClock
from aero.driver import AeroHand
from aero.firmware import DEFAULT_FIRMWARE, firmware_of
from aero.safety import GuardedHand, Standby, Thresholds, unwinding
from aero.serial_transport import SerialTransport

Hand = AeroHand | GuardedHand
"""Hand moved by an experiment. `AeroHand` documents each call; `GuardedHand` documents only its differences."""


@contextmanager
def open_hand(
    port_or_url: str,
    *,
    firmware: str = DEFAULT_FIRMWARE,
    calibration: str | None = None,
    side: str = "right",
    thresholds: Thresholds | None = None,
) -> Iterator[GuardedHand]:
    """Open a guarded hand: gentle start, polled while it moves, open and weak at the end.

    Use it in a `with` statement. A standby process opens the hand if this process is killed. SIGTERM and SIGHUP end the
    block as Ctrl-C does. Wait on `hand.clock`, which polls the hand meanwhile. For an unguarded hand use
    `AeroHand.open_unguarded`.

    Args:
        port_or_url: device path or pyserial URL.
        firmware: version on the hand; no board reports it.
        calibration: state of the command windows, see `CommandWindow.for_firmware`.
        side: `right` or `left`.
        thresholds: stop criteria; None for the defaults.

    Raises:
        ValueError: an unknown firmware, calibration or side.
        ConnectionError: the port cannot be opened; the message has the reason and the ports of this computer.
        SafetyStopError: at the end of the block the hand may not be open; the message has a remedy.
    """
    limits, usual = thresholds or Thresholds(), firmware_of(firmware).settings
    spans = CommandWindow.for_firmware(firmware, calibration, side).spans_counts()
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
