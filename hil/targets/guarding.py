"""From an open transport to a driver, guarded where the hand can be hurt."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from aero import AeroHand
from aero.actuation import ActuationMap
from aero.clock import Clock
from aero.safety import GuardedHand, Settings, Thresholds, lifeline, unwinding
from aero.transport import Transport
from firmware_emulator.firmware.frames import Opcode
from firmware_emulator.firmware.profiles import profile_of


def usual_settings(firmware: str) -> Settings | None:
    """Return the limits a firmware starts with; None when it has no way to set them."""
    profile = profile_of(firmware)
    return Settings(profile.speed, profile.torque) if Opcode.SET_TOR in profile.opcodes else None


def drive(
    transport: Transport,
    clock: Clock,
    codec: ActuationMap,
    firmware: str,
    *,
    thresholds: Thresholds | None,
    on_first_motion: Callable[[], None] = lambda: None,
) -> AeroHand:
    """Return a driver on an open transport, guarded when there are thresholds."""
    if thresholds is None:
        return AeroHand(transport, clock)
    return guard(transport, clock, codec, firmware, thresholds, on_first_motion=on_first_motion)


def guard(
    transport: Transport,
    clock: Clock,
    codec: ActuationMap,
    firmware: str,
    thresholds: Thresholds,
    *,
    on_first_motion: Callable[[], None] = lambda: None,
) -> GuardedHand:
    """Return a guarded driver on an open transport, made for one firmware."""
    return GuardedHand(
        transport,
        clock,
        spans_counts=codec.window.spans_counts(),
        usual=usual_settings(firmware),
        thresholds=thresholds,
        on_first_motion=on_first_motion,
    )


@contextmanager
def ready_for_the_worst(port: str, thresholds: Thresholds | None, firmware: str) -> Iterator[Callable[[], None]]:
    """Prepare for this program being terminated or killed; yields what a guarded hand calls before it first moves."""
    if thresholds is None:
        yield lambda: None
        return
    with unwinding(), lifeline(port, thresholds, settable=usual_settings(firmware) is not None) as start:
        yield start
