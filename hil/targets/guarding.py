"""From an open transport to a driver, guarded where the hand can be hurt."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from aero import AeroHand
from aero.actuation import ActuationMap
from aero.clock import Clock
from aero.firmware import firmware_of
from aero.hand import Hand
from aero.safety import GuardedHand, Standby, Thresholds, unwinding
from aero.transport import Transport


def drive(
    transport: Transport,
    clock: Clock,
    codec: ActuationMap,
    firmware: str,
    *,
    thresholds: Thresholds | None,
    standby: Standby | None = None,
) -> Hand:
    """Return a driver on an open transport, guarded when there are thresholds."""
    if thresholds is None:
        return AeroHand(transport, clock)
    return guard(transport, clock, codec, firmware, thresholds, standby=standby)


def guard(
    transport: Transport,
    clock: Clock,
    codec: ActuationMap,
    firmware: str,
    thresholds: Thresholds,
    *,
    standby: Standby | None = None,
) -> GuardedHand:
    """Return a guarded driver on an open transport, made for one firmware."""
    return GuardedHand(
        transport,
        clock,
        spans_counts=codec.window.spans_counts(),
        usual=firmware_of(firmware).settings,
        thresholds=thresholds,
        standby=standby,
    )


@contextmanager
def ready_for_the_worst(port: str, thresholds: Thresholds | None, firmware: str) -> Iterator[Standby | None]:
    """Prepare for this program being terminated or killed; yields what a guarded hand needs for it."""
    if thresholds is None:
        yield None
        return
    with unwinding():
        yield Standby(port, thresholds, settable=firmware_of(firmware).settings is not None)
