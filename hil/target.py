"""Targets: what a test or an experiment runs against, opened by the value that `--hil` takes.

An experiment sees a `Target` and never asks which kind it is. What only an emulated hand can do is a capability that
is asked for by name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from aero import AeroHand
from aero.actuation import ActuationMap
from aero.channels import Channel
from aero.clock import Clock, WallClock
from aero.errors import AeroError
from aero.safety import GuardedHand, Thresholds, WatchedClock
from aero.serial_transport import SerialTransport
from aero.transport import Transport
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import InProcessLink
from hil.awake import cores_awake
from hil.emulated import build_emulated
from hil.pty_process import serve_in_process
from hil.recording import Side
from hil.safety.driving import drive, ready_for_the_worst
from hil.units import DEFAULT_LIMITS, Unit, load_unit
from hil.wiretap import WireTap
from model import BuiltHandPlant

DEFAULT_FIRMWARE = "0.2.0"
PHYSICAL = "physical"
"""Unit name of a hand that is none of ours."""


class NoHandError(Exception):
    """No hand answers at the target; the message names it and says what to try."""


class MissingCapabilityError(Exception):
    """The target cannot do what was asked for; the message says which could."""


@dataclass(frozen=True)
class Target:
    """One hand, ready to be commanded, and everything an experiment may know about it."""

    name: str
    """What `--hil` was."""
    hand: AeroHand
    clock: Clock
    map: ActuationMap
    firmware: str
    side: Side
    unit: str
    """Unit file of an emulated hand, `physical` for one on a port."""
    limits: str
    """Kind of hand whose limits it is judged by."""
    seed: int
    wire: WireTap
    """Everything that crossed the link since it was opened."""
    capabilities: Mapping[str, Any]
    """`ground_truth`: the plant (joint angles, cable tensions, slack); `electronics`: the emulated hand."""

    @property
    def real_time(self) -> bool:
        """Whether a second of hand time costs a second."""
        return isinstance(self.clock.bare if isinstance(self.clock, WatchedClock) else self.clock, WallClock)

    @property
    def guard(self) -> GuardedHand | None:
        """The hand, when it is guarded."""
        return self.hand if isinstance(self.hand, GuardedHand) else None

    def begin(self, *, stops: Iterable[Channel] = ()) -> None:
        """Let a guarded hand be checked and opened before the clock of an experiment starts; others need nothing.

        Args:
            stops: channels that the experiment drives into their stops, and that are weakened for it.

        Raises:
            SafetyStopError: it must not be moved, or did not open.
        """
        if self.guard is not None:
            self.guard.expect_stops(stops)

    def capability(self, name: str) -> Any:
        """Return what stands behind a capability.

        Raises:
            MissingCapabilityError: this target does not have it.
        """
        if name not in self.capabilities:
            raise MissingCapabilityError(f"{self.name} has no {name}; run with --hil=emulated for it")
        return self.capabilities[name]

    def describe(self) -> str:
        """Say in one line what this is."""
        return f"{self.side} hand on {self.name}, firmware {self.firmware}, unit {self.unit}, seed {self.seed}"


def open_target(
    target: str = "emulated",
    *,
    firmware: str | None = None,
    hand: Side = "right",
    unit: str = "reference",
    seed: int = 0,
    guarded: bool | None = None,
    thresholds: Thresholds | None = None,
    firmware_program: Path | str | None = None,
) -> AbstractContextManager[Target]:
    """Open a hand; use it in a `with` statement.

    A guarded hand starts gently, is watched while it moves, and is opened and left weak when the statement ends, with
    or without an error; see `aero.safety.GuardedHand`.

    Args:
        target: `emulated` (this process, virtual time), `pty` (own process, real time), or the path or pyserial URL of
            a physical hand's port.
        firmware: version that is emulated, or that the physical hand runs (no board can report its own); 0.2.0 when
            not given.
        hand: side.
        unit: shipped name or `.toml` path of the emulated hand; a physical hand has none.
        seed: of the emulated hand's noise.
        guarded: whether the hand is guarded; a physical one is unless this is False.
        thresholds: when a guarded hand is stopped; the defaults when None.
        firmware_program: what `aero-hil firmware build` made, to run on the board of an `emulated` or `pty` hand;
            `firmware` and `hand` then say what it was made from.

    Raises:
        ValueError: an unknown firmware, side or unit; a firmware program for a physical hand.
        FirmwareProgramError: the firmware program does not run, on entering the context.
        NoHandError: nothing answers at the port, on entering the context.
    """
    kinds: dict[str, Opener] = {"emulated": _emulated, "pty": _pty}
    version = firmware or DEFAULT_FIRMWARE
    codec = ActuationMap.for_firmware(version, hand=hand)
    guard = (thresholds or Thresholds()) if (target not in kinds if guarded is None else guarded) else None
    if firmware_program is not None and target not in kinds:
        raise ValueError(f"a firmware program runs on an emulated hand, not on {target!r}; give `emulated` or `pty`")
    program = Path(firmware_program) if firmware_program is not None else None
    request = Request(target, codec, version, hand, load_unit(unit), seed, guard, program)
    return kinds.get(target, _physical)(request)


@dataclass(frozen=True)
class Request:
    """What was asked of `open_target`, checked."""

    name: str
    map: ActuationMap
    firmware: str
    side: Side
    unit: Unit
    seed: int
    thresholds: Thresholds | None = None
    """Of the guard; None without one."""
    program: Path | None = None
    """Firmware program on the board of an emulated hand."""

    def granted(self, hand: AeroHand, clock: Clock, wire: WireTap, **more: Any) -> Target:
        """Return the target, with `more` in place of what was asked."""
        watched = hand.clock if isinstance(hand, GuardedHand) else clock
        asked = {"unit": self.unit.name, "limits": self.unit.limits, "capabilities": {}} | more
        return Target(self.name, hand, watched, self.map, self.firmware, self.side, seed=self.seed, wire=wire, **asked)


Opener = Callable[[Request], AbstractContextManager[Target]]


@contextmanager
def _emulated(request: Request) -> Iterator[Target]:
    electronics, plant = build_emulated(
        request.unit, firmware=request.firmware, hand=request.side, seed=request.seed, program=request.program
    )
    with closing(electronics), in_process(request, electronics, plant, InProcessLink(electronics)) as target:
        yield target


@contextmanager
def in_process(request: Request, electronics: EmulatedHand, plant: BuiltHandPlant, link: Transport) -> Iterator[Target]:
    """Make a target of an emulated hand in this process and the link to it."""
    clock = electronics.clock
    wire = WireTap(link, clock)
    with drive(wire, clock, request.map, request.firmware, thresholds=request.thresholds) as hand:
        yield request.granted(hand, clock, wire, capabilities={"ground_truth": plant, "electronics": electronics})


@contextmanager
def _pty(request: Request) -> Iterator[Target]:
    served = serve_in_process(
        firmware=request.firmware,
        hand=request.side,
        unit=request.unit.name,
        seed=request.seed,
        program=request.program,
    )
    with cores_awake(), served as path, _serial(request, path) as (hand, clock, wire):
        yield request.granted(hand, clock, wire)


@contextmanager
def _physical(request: Request) -> Iterator[Target]:
    with _serial(request, request.name) as (hand, clock, wire):
        yield request.granted(hand, clock, wire, unit=PHYSICAL, limits=DEFAULT_LIMITS)


@contextmanager
def _serial(request: Request, port: str) -> Iterator[tuple[AeroHand, Clock, WireTap]]:
    try:
        transport = SerialTransport.open(port)
    except (ConnectionError, ValueError) as error:
        raise NoHandError(
            f"no hand at {port!r}: {error} Give the hand's port (Linux: /dev/ttyACM0 or a path below "
            "/dev/serial/by-id), a pyserial URL, or `emulated` or `pty` for a hand without hardware."
        ) from error
    clock = WallClock()
    wire = WireTap(transport, clock)
    with (
        ready_for_the_worst(port, request.thresholds, request.firmware) as on_first_motion,
        drive(
            wire,
            clock,
            request.map,
            request.firmware,
            thresholds=request.thresholds,
            on_first_motion=on_first_motion,
        ) as hand,
    ):
        try:
            hand.read_codes()
        except (AeroError, ConnectionError) as error:
            raise NoHandError(f"no hand answers at {port!r}: {error}") from error
        yield hand, clock, wire
