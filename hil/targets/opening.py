"""Opening of a hand on a port."""

import os
from collections.abc import Iterator
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import dataclass, field
from typing import Any

from serial.tools.list_ports import comports

from aero import AeroHand
from aero.actuation import ActuationMap
from aero.clock import Clock
from aero.errors import AeroError
from aero.firmware import firmware_of
from aero.hand import Hand
from aero.safety import GuardedHand, SafetyStopError, Standby, Thresholds, unwinding
from aero.serial_transport import SerialTransport
from aero.side import Side
from aero.transport import Transport
from hil.targets.argument_names import suggesting
from hil.targets.delays import TRIES, DelayLog, TimedClock, TimedTransport, held_up
from hil.targets.hand_errors import NoHandError
from hil.targets.hand_spec import PortSpec, named_port
from hil.targets.target import Target
from hil.targets.wire_log import WireLog

NOT_UNIQUE = frozenset({"0001"})
"""Serial numbers of many boards: that of a CP2102 as delivered (Silicon Labs, AN144)."""


@suggesting
def open_port(
    port: str,
    *,
    side: Side | None = None,
    firmware: str | None = None,
    guarded: bool = True,
    thresholds: Thresholds | None = None,
    hand_id: str | None = None,
) -> AbstractContextManager[Target]:
    """Return a context manager that opens a hand on a port.

    A guarded hand starts gently and is monitored in motion. At the end of the context, even after an error, it is
    opened with reduced torque; see `aero.safety.GuardedHand`.

    Args:
        port: path or pyserial URL of the port, or a name in `hands.toml`, whose values None takes below.
        side: `right` (the default) or `left`.
        firmware: declared version; a board cannot report its own.
        guarded: False to drive the hand without the guard.
        thresholds: thresholds of the guard.
        hand_id: name of the individual hand; by default the serial number of its USB port.

    Raises:
        ValueError: an unknown name, side or firmware, an error in `hands.toml`, or an emulated hand.
        NoHandError: no port, or no reply; raised at the start of the context.
    """
    return open_spec(
        named_port(port, side=side, firmware=firmware, guarded=guarded, thresholds=thresholds, hand_id=hand_id)
    )


@contextmanager
def open_spec(spec: PortSpec) -> Iterator[Target]:
    """Open the hand on the port of a specification; see `open_port`."""
    opening = Opening(spec)
    with driven(opening, spec.port) as (hand, clock, wire):
        serial = serial_number(spec.port)
        fields = opening.fields(hand, clock, wire) | {"hand_id": spec.hand_id or serial}
        yield Target(**fields, serial_number=serial)


@dataclass(frozen=True)
class Opening:
    """Parameters of the opening of a hand."""

    spec: PortSpec
    delays: DelayLog = field(default_factory=DelayLog)
    """Scheduling delays, recorded in real time only."""

    @property
    def map(self) -> ActuationMap:
        """Actuation map of the hand's firmware and side."""
        return ActuationMap.for_firmware(self.spec.firmware, side=self.spec.side)

    def fields(self, hand: Hand, clock: Clock, wire: WireLog) -> dict[str, Any]:
        """Return the fields of `Target` that every hand has."""
        spec = self.spec
        return {
            "port": spec.port,
            "hand": hand,
            "clock": hand.clock if isinstance(hand, GuardedHand) else clock,
            "map": self.map,
            "firmware": spec.firmware,
            "side": spec.side,
            "hand_id": spec.hand_id,
            "wire": wire,
            "delays": self.delays,
        }


def serial_number(port: str) -> str:
    """Return the serial number of a USB port; empty if it has none that identifies it."""
    device = os.path.realpath(port)
    number = next((found.serial_number or "" for found in comports() if found.device == device), "")
    return "" if number in NOT_UNIQUE else number


@contextmanager
def driven(opening: Opening, port: str) -> Iterator[tuple[Hand, Clock, WireLog]]:
    """Yield the driver on a port, with its clock and the log of its bytes.

    Raises:
        NoHandError: no port, or no reply of a hand that must answer.
    """
    try:
        transport = SerialTransport.open(port)
    except (ConnectionError, ValueError) as error:
        raise NoHandError(
            f"no hand at {port!r}: {error} Give the hand's port (Linux: /dev/ttyACM0 or a path below "
            "/dev/serial/by-id), a pyserial URL, or `emulated` or `pty` for a hand without hardware."
        ) from error
    clock = TimedClock(opening.delays)
    wire = WireLog(TimedTransport(transport, clock), clock)
    with (
        closing(clock),
        _standby_process(port, opening.spec.guard, opening.spec.firmware) as standby,
        drive(wire, clock, opening, standby) as hand,
    ):
        first_reading(hand, opening.delays, port, required=not opening.spec.may_be_silent)
        try:
            yield hand, clock, wire
        except (AeroError, SafetyStopError) as error:
            # A host delay may be the cause, so name it before the error.
            if busy := held_up(opening.delays):
                error.args = (f"{busy}{error}", *error.args[1:])
            raise


def first_reading(hand: Hand, delays: DelayLog, port: str, *, required: bool = True) -> None:
    """Check that a newly opened hand answers; retry after a scheduling delay of this host.

    Raises:
        NoHandError: the hand does not answer, and an answer is required.
    """
    for tries_left in reversed(range(TRIES)):
        try:
            hand.read_codes()
        except (AeroError, ConnectionError) as error:
            busy = held_up(delays)
            if not (busy and tries_left) or isinstance(error, ConnectionError):
                if not required:
                    return
                raise NoHandError(f"{busy}no hand answers at {port!r}: {error}") from error
        else:
            return


def drive(transport: Transport, clock: Clock, opening: Opening, standby: Standby | None = None) -> Hand:
    """Return a driver on an open transport, guarded if the specification has thresholds."""
    thresholds = opening.spec.guard
    if thresholds is None:
        return AeroHand(transport, clock)
    return guard(transport, clock, opening.map, opening.spec.firmware, thresholds, standby=standby)


def guard(
    transport: Transport,
    clock: Clock,
    codec: ActuationMap,
    firmware: str,
    thresholds: Thresholds,
    *,
    standby: Standby | None = None,
) -> GuardedHand:
    """Return a guarded driver on an open transport, for one firmware."""
    return GuardedHand(
        transport,
        clock,
        spans_counts=codec.window.spans_counts(),
        usual=firmware_of(firmware).settings,
        thresholds=thresholds,
        standby=standby,
    )


@contextmanager
def _standby_process(port: str, thresholds: Thresholds | None, firmware: str) -> Iterator[Standby | None]:
    """Handle termination signals, and yield the standby that opens a guarded hand after a kill (None if unguarded)."""
    if thresholds is None:
        yield None
        return
    with unwinding():
        yield Standby(port, thresholds, settable=firmware_of(firmware).settings is not None)
