"""Opening a target: an emulated hand in this process, one on a pseudo-terminal, or a physical one on a port."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from serial.tools.list_ports import comports

from aero import AeroHand
from aero.actuation import ActuationMap
from aero.clock import Clock
from aero.errors import AeroError
from aero.firmware import DEFAULT_FIRMWARE, firmware_of
from aero.hand import Hand
from aero.safety import GuardedHand, SafetyStopError, Standby, Thresholds, unwinding
from aero.serial_transport import SerialTransport
from aero.transport import Transport
from hil.faults.fault import Injection
from hil.faults.host import refuse_at_a_port
from hil.faults.schedule import Schedule
from hil.faults.workbench import Workbench
from hil.targets.delays import TRIES, DelayLog, TimedClock, TimedTransport, held_up
from hil.targets.emulated_hand import build_emulated, found_as, host_link
from hil.targets.hands_file import named_hand
from hil.targets.pty_process import serve_in_process
from hil.targets.target import PHYSICAL, GroundTruth, NoHandError, Target
from hil.targets.wire_log import WireLog
from model.geometry import Side
from model.scene import Cube
from model.units import Unit
from model.units.conditions import Conditions
from model.units.naming import unit_named


def open_target(
    target: str = "emulated",
    *,
    firmware: str | None = None,
    hand: Side | None = None,
    unit: str = "reference",
    seed: int = 0,
    guarded: bool | None = None,
    thresholds: Thresholds | None = None,
    hand_id: str = "",
    firmware_program: Path | str | None = None,
    homed: bool = False,
    faults: Iterable[Injection] = (),
    cube: Cube | None = None,
    conditions: Conditions | None = None,
) -> AbstractContextManager[Target]:
    """Open a hand; use it in a `with` statement.

    A guarded hand starts gently, is watched while it moves, and is opened and left weak when the statement ends, with
    or without an error; see `aero.safety.GuardedHand`.

    Args:
        target: `emulated` (this process, virtual time), `pty` (own process, real time), the path or pyserial URL of a
            physical hand's port, or a name in `hands.toml`, see `hil.targets.hands_file`.
        firmware: version that is emulated, or that the physical hand runs (no board can report its own); that of
            `hands.toml` when not given, else 0.2.0.
        hand: side; that of `hands.toml` when not given, else right.
        unit: shipped name, `plausible:SEED` or `.toml` path of the emulated hand; a physical hand has none.
        seed: of the emulated hand's noise.
        guarded: whether the hand is guarded; a physical one is unless this is False.
        thresholds: when a guarded hand is stopped; the defaults when None.
        hand_id: name of the individual hand, for its recordings; when not given, its name in `hands.toml` or the serial
            number of its USB port.
        firmware_program: what `aero-hil firmware build` made, to run on the board of an `emulated` or `pty` hand;
            `firmware` and `hand` then say what it was made from.
        homed: whether an emulated hand is homed when it is opened, as every physical hand has been; its encoders' zeros
            are ideal when not.
        faults: what is wrong with an `emulated` or `pty` hand, see `hil.faults`; their chances come from `seed`.
        cube: lies ready beside an `emulated` hand; its ground truth is then a `model.cube_plant.CubePlant`.
        conditions: how an `emulated` hand is found, none of which is a fault; as its unit says when None.

    Raises:
        ValueError: an unknown name, firmware, side or unit; a mistake in `hands.toml`; a firmware program or faults for
            a physical hand; faults that cannot be combined; a cube for another hand than an `emulated` one;
            conditions for another than an `emulated` one.
        FaultNeverFiredError: one of the faults had no effect, on leaving the context without another error.
        FirmwareProgramError: the firmware program does not run, on entering the context.
        NoHandError: nothing answers at the port, on entering the context.
    """
    kinds: dict[str, Opener] = {"emulated": _emulated, "pty": _pty}
    named = named_hand(target)
    target, hand_id = named.port, hand_id or named.name
    version, side = firmware or named.firmware or DEFAULT_FIRMWARE, hand or named.side or "right"
    codec = ActuationMap.for_firmware(version, hand=side)
    guard = (thresholds or Thresholds()) if (target not in kinds if guarded is None else guarded) else None
    if firmware_program is not None and target not in kinds:
        raise ValueError(f"a firmware program runs on an emulated hand, not on {target!r}; give `emulated` or `pty`")
    schedule = Schedule(faults, seed)
    if schedule.faults and target not in kinds:
        raise ValueError(
            f"faults are injected into an emulated hand, not into {target!r}; see `aero-hil proxy` for its link"
        )
    if cube is not None and target != "emulated":
        raise ValueError(f"a cube is put into a hand in this process, `emulated`, not into {target!r}")
    if conditions is not None and target != "emulated":
        raise ValueError(f"conditions are those of a hand in this process, `emulated`, not of {target!r}")
    if target == "pty":
        refuse_at_a_port(schedule.faults)
    program = Path(firmware_program) if firmware_program is not None else None
    found = conditions or Conditions()
    built = found.applied(unit_named(unit)) if conditions else unit_named(unit)
    request = OpenRequest(
        target, codec, version, side, built, seed, guard, hand_id, program, homed, schedule, cube, found
    )
    return kinds.get(target, _physical)(request)


@dataclass(frozen=True)
class OpenRequest:
    """What was asked of `open_target`, checked."""

    name: str
    map: ActuationMap
    firmware: str
    side: Side
    unit: Unit
    seed: int
    thresholds: Thresholds | None = None
    """Thresholds of the guard; None without one."""
    hand_id: str = ""
    program: Path | None = None
    """Firmware program on the board of an emulated hand."""
    homed: bool = False
    """Whether an emulated hand is homed first."""
    schedule: Schedule = field(default_factory=Schedule)
    """Faults of an emulated hand."""
    cube: Cube | None = None
    """For an emulated hand in this process."""
    conditions: Conditions = field(default_factory=Conditions)
    """Conditions of an emulated hand in this process; its unit has been changed for them."""

    delays: DelayLog = field(default_factory=DelayLog)
    """Filled in real time alone."""

    def granted(self, hand: Hand, clock: Clock, wire: WireLog, **more: Any) -> Target:
        """Return the target, with `more` in place of what was asked."""
        watched = hand.clock if isinstance(hand, GuardedHand) else clock
        asked = {"unit": self.unit.name, "hand_id": self.hand_id} | more
        asked |= {"faults": self.schedule.faults, "delays": self.delays}
        return Target(self.name, hand, watched, self.map, self.firmware, self.side, seed=self.seed, wire=wire, **asked)


Opener = Callable[[OpenRequest], AbstractContextManager[Target]]


@contextmanager
def _emulated(request: OpenRequest) -> Iterator[Target]:
    electronics, workbench = build_emulated(
        request.unit,
        firmware=request.firmware,
        hand=request.side,
        seed=request.seed,
        program=request.program,
        schedule=request.schedule,
        cube=request.cube,
    )
    with closing(electronics), in_process(request, workbench, host_link(workbench)) as target:
        yield target
    request.schedule.require_all_fired()


@contextmanager
def in_process(request: OpenRequest, workbench: Workbench, link: Transport) -> Iterator[Target]:
    """Make a target of an emulated hand in this process and the link to it."""
    electronics = workbench.hand
    clock = electronics.clock
    settable = firmware_of(request.firmware).settings is not None
    found = found_as(request.conditions, link, clock, settable=settable, seed=request.seed)
    wire = WireLog(found, clock)
    with _drive(wire, clock, request.map, request.firmware, thresholds=request.thresholds) as hand:
        if request.homed:
            hand.home()
        yield request.granted(
            hand, clock, wire, capabilities=(GroundTruth(workbench.mechanics, electronics), workbench)
        )


@contextmanager
def _pty(request: OpenRequest) -> Iterator[Target]:
    served = serve_in_process(
        firmware=request.firmware,
        hand=request.side,
        unit=request.unit.name,
        seed=request.seed,
        delays=request.delays,
        program=request.program,
        faults=request.schedule.faults,
        homed=request.homed,
    )
    with served as path, _serial(request, path) as (hand, clock, wire):
        yield request.granted(hand, clock, wire)


@contextmanager
def _physical(request: OpenRequest) -> Iterator[Target]:
    with _serial(request, request.name) as (hand, clock, wire):
        known = request.hand_id or serial_number(request.name)
        yield request.granted(hand, clock, wire, unit=PHYSICAL, hand_id=known)


def serial_number(port: str) -> str:
    """Return the serial number that a USB port says about itself, empty for a port that has none."""
    device = os.path.realpath(port)
    return next((found.serial_number or "" for found in comports() if found.device == device), "")


@contextmanager
def _serial(request: OpenRequest, port: str) -> Iterator[tuple[Hand, Clock, WireLog]]:
    try:
        transport = SerialTransport.open(port)
    except (ConnectionError, ValueError) as error:
        raise NoHandError(
            f"no hand at {port!r}: {error} Give the hand's port (Linux: /dev/ttyACM0 or a path below "
            "/dev/serial/by-id), a pyserial URL, or `emulated` or `pty` for a hand without hardware."
        ) from error
    clock = TimedClock(request.delays)
    wire = WireLog(TimedTransport(transport, clock), clock)
    with (
        closing(clock),
        _standby_process(port, request.thresholds, request.firmware) as standby,
        _drive(
            wire,
            clock,
            request.map,
            request.firmware,
            thresholds=request.thresholds,
            standby=standby,
        ) as hand,
    ):
        _first_reading(hand, request.delays, port)
        try:
            yield hand, clock, wire
        except (AeroError, SafetyStopError) as error:
            # What could be this computer is said first.
            if busy := held_up(request.delays):
                error.args = (f"{busy}{error}", *error.args[1:])
            raise


def _first_reading(hand: Hand, delays: DelayLog, port: str) -> None:
    """Read a hand that has just been opened, again where this computer was too busy to hear it.

    Raises:
        NoHandError: it does not answer.
    """
    for tries_left in reversed(range(TRIES)):
        try:
            hand.read_codes()
        except (AeroError, ConnectionError) as error:
            busy = held_up(delays)
            if not (busy and tries_left) or isinstance(error, ConnectionError):
                raise NoHandError(f"{busy}no hand answers at {port!r}: {error}") from error
        else:
            return


def _drive(
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
def _standby_process(port: str, thresholds: Thresholds | None, firmware: str) -> Iterator[Standby | None]:
    """Prepare for this program being terminated or killed; yields what a guarded hand needs for it."""
    if thresholds is None:
        yield None
        return
    with unwinding():
        yield Standby(port, thresholds, settable=firmware_of(firmware).settings is not None)
