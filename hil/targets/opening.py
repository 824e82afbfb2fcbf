"""Opening of a target: an emulated hand in this process or on a pseudo-terminal, or a physical hand on a port."""

import os
from collections.abc import Iterator
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import dataclass, field, replace
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
from aero.transport import Transport
from hil.emulated.emulated_hand import build_emulated, host_link, with_initial_conditions
from hil.emulated.faults.bench import HandBench
from hil.emulated.faults.schedule import Schedule
from hil.emulated.faults.workbench import Workbench
from hil.emulated.pty_process import serve_in_child
from hil.targets.delays import TRIES, DelayLog, TimedClock, TimedTransport, held_up
from hil.targets.hand_errors import NoHandError
from hil.targets.hand_spec import HOMINGS, PHYSICAL, HandSpec
from hil.targets.target import GroundTruth, Target
from hil.targets.wire_log import WireLog
from model.units import Unit
from model.units.conditions import Conditions
from model.units.plausible import unit_named


def open_target(target: HandSpec | str = "emulated", **fields: Any) -> AbstractContextManager[Target]:
    """Return a context manager that opens a hand.

    A guarded hand starts gently and is monitored in motion. At the end of the context, even after an error, it is
    opened with reduced torque; see `aero.safety.GuardedHand`.

    Args:
        target: specification of the hand, or its target or name in `hands.toml`.
        fields: with a target or a name, the arguments of `HandSpec.named`; with a specification, fields to replace.

    Raises:
        ValueError: fields that `HandSpec.named` refuses; an unknown unit; a fault that cannot be injected.
        FaultNeverFiredError: a fault had no effect; raised at the end of a context without another error.
        FirmwareProgramError: the firmware program does not run; raised at the start of the context.
        NoHandError: no port, or no reply at the port of a hand that must answer; raised at the start of the context.
    """
    spec = HandSpec.named(target, **fields) if isinstance(target, str) else replace(target, **fields)
    unit = unit_named(spec.unit)
    if spec.conditions is not None:
        unit = spec.conditions.applied(unit)
    opening = Opening(spec, unit, Schedule(spec.faults, spec.seed))
    return {"emulated": _emulated, "pty": _pty}.get(spec.target, _physical)(opening)


@dataclass(frozen=True)
class Opening:
    """Parameters of the opening of a hand."""

    spec: HandSpec
    unit: Unit
    """Unit of an emulated hand, adapted to its initial conditions."""
    schedule: Schedule = field(default_factory=Schedule)
    """Faults of the hand, with their firing state."""
    delays: DelayLog = field(default_factory=DelayLog)
    """Scheduling delays, recorded in real time only."""

    @property
    def map(self) -> ActuationMap:
        """Actuation map of the hand's firmware and side."""
        return ActuationMap.for_firmware(self.spec.firmware, side=self.spec.side)

    def granted(self, hand: Hand, clock: Clock, wire: WireLog, **more: Any) -> Target:
        """Return the open target; `more` overrides its fields."""
        spec = self.spec
        watched = hand.clock if isinstance(hand, GuardedHand) else clock
        asked = {"unit": self.unit.name, "hand_id": spec.hand_id} | more
        asked |= {"faults": self.schedule.faults, "delays": self.delays}
        return Target(
            spec.target, hand, watched, self.map, spec.firmware, spec.side, seed=spec.seed, wire=wire, **asked
        )


@contextmanager
def _emulated(opening: Opening) -> Iterator[Target]:
    electronics, workbench = build_emulated(opening.unit, opening.spec, schedule=opening.schedule)
    with closing(electronics), in_process(opening, workbench, host_link(workbench)) as target:
        yield target
    opening.schedule.require_all_fired()


@contextmanager
def in_process(opening: Opening, workbench: Workbench, link: Transport) -> Iterator[Target]:
    """Yield the target of an emulated hand in this process, reached by `link`."""
    spec, electronics = opening.spec, workbench.electronics
    clock = electronics.clock
    settable = firmware_of(spec.firmware).settings is not None
    found = with_initial_conditions(spec.conditions or Conditions(), link, clock, settable=settable, seed=spec.seed)
    wire = WireLog(found, clock)
    with _drive(wire, clock, opening) as hand:
        for _ in range(HOMINGS if spec.homed else 0):
            hand.home()
        yield opening.granted(
            hand,
            clock,
            wire,
            capabilities=(GroundTruth(workbench.mechanics, electronics), workbench, HandBench.of(workbench)),
        )


@contextmanager
def _pty(opening: Opening) -> Iterator[Target]:
    with (
        serve_in_child(opening.spec, opening.delays) as (path, bench),
        _serial(opening, path) as (hand, clock, wire),
    ):
        yield opening.granted(hand, clock, wire, capabilities=(bench,))


@contextmanager
def _physical(opening: Opening) -> Iterator[Target]:
    with _serial(opening, opening.spec.target) as (hand, clock, wire):
        serial = serial_number(opening.spec.target)
        known = opening.spec.hand_id or serial
        yield opening.granted(hand, clock, wire, unit=PHYSICAL, hand_id=known, serial_number=serial)


def serial_number(port: str) -> str:
    """Return the serial number of a USB port; empty if it has none."""
    device = os.path.realpath(port)
    return next((found.serial_number or "" for found in comports() if found.device == device), "")


@contextmanager
def _serial(opening: Opening, port: str) -> Iterator[tuple[Hand, Clock, WireLog]]:
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
        _drive(wire, clock, opening, standby) as hand,
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


def _drive(transport: Transport, clock: Clock, opening: Opening, standby: Standby | None = None) -> Hand:
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
