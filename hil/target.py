"""Targets: what a test or an experiment runs against, opened by the value that `--hil` takes.

An experiment sees a `Target` and never asks which kind it is. What only an emulated hand can do is a capability that
is asked for by name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from typing import Any, Literal

from aero import AeroHand
from aero.actuation import ActuationMap
from aero.clock import Clock, WallClock
from aero.errors import AeroError
from aero.serial_transport import SerialTransport
from aero.transport import Transport
from hil.emulated import build_emulated
from hil.pty_process import serve_in_process
from hil.units import load_unit
from hil.wiretap import WireTap

Side = Literal["right", "left"]

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
    capabilities: Mapping[str, Any] = field(default_factory=dict)
    """`ground_truth`: the plant (joint angles, cable tensions, slack); `electronics`: the emulated hand."""

    @property
    def real_time(self) -> bool:
        """Whether a second of hand time costs a second."""
        return isinstance(self.clock, WallClock)

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
) -> AbstractContextManager[Target]:
    """Open a hand; use it in a `with` statement.

    Args:
        target: `emulated` (this process, virtual time), `pty` (own process, real time), or the path or pyserial URL of
            a physical hand's port.
        firmware: version that is emulated, or that the physical hand runs (no board can report its own); 0.2.0 when
            not given.
        hand: side.
        unit: shipped name or `.toml` path of the emulated hand; a physical hand is judged as `reference` is.
        seed: of the emulated hand's noise.

    Raises:
        ValueError: an unknown firmware, side or unit.
        NoHandError: nothing answers at the port, on entering the context.
    """
    kinds: dict[str, Callable[..., AbstractContextManager[Target]]] = {"emulated": _emulated, "pty": _pty}
    codec = ActuationMap.for_firmware(firmware or DEFAULT_FIRMWARE, hand=hand)
    return kinds.get(target, _physical)(target, codec, firmware or DEFAULT_FIRMWARE, hand, unit, seed)


@contextmanager
def _emulated(name: str, codec: ActuationMap, firmware: str, side: Side, unit_name: str, seed: int) -> Iterator[Target]:
    unit = load_unit(unit_name)
    link, electronics, plant = build_emulated(unit, firmware=firmware, hand=side, seed=seed)
    capabilities = {"ground_truth": plant, "electronics": electronics}
    wire = WireTap(link, electronics.clock)
    with AeroHand(wire, electronics.clock) as hand:
        yield Target(
            name, hand, electronics.clock, codec, firmware, side, unit_name, unit.limits, seed, wire, capabilities
        )


@contextmanager
def _pty(name: str, codec: ActuationMap, firmware: str, side: Side, unit_name: str, seed: int) -> Iterator[Target]:
    unit = load_unit(unit_name)
    with serve_in_process(firmware=firmware, hand=side, unit=unit_name, seed=seed) as path, _serial(path) as wire:
        clock = WallClock()
        hand = AeroHand(wire, clock)
        _require_answer(hand, name)
        yield Target(name, hand, clock, codec, firmware, side, unit_name, unit.limits, seed, wire)


@contextmanager
def _physical(name: str, codec: ActuationMap, firmware: str, side: Side, _unit: str, seed: int) -> Iterator[Target]:
    with _serial(name) as wire:
        clock = WallClock()
        hand = AeroHand(wire, clock)
        _require_answer(hand, name)
        yield Target(name, hand, clock, codec, firmware, side, PHYSICAL, load_unit("reference").limits, seed, wire)


@contextmanager
def _serial(port: str) -> Iterator[WireTap]:
    try:
        transport: Transport = SerialTransport.open(port)
    except (ConnectionError, ValueError) as error:
        raise NoHandError(
            f"no hand at {port!r}: {error} Give the hand's port (Linux: /dev/ttyACM0 or a path below "
            "/dev/serial/by-id), a pyserial URL, or `emulated` or `pty` for a hand without hardware."
        ) from error
    wire = WireTap(transport, WallClock())
    try:
        yield wire
    finally:
        wire.close()


def _require_answer(hand: AeroHand, name: str) -> None:
    try:
        hand.read_codes()
    except (AeroError, ConnectionError) as error:
        raise NoHandError(f"no hand answers at {name!r}: {error}") from error
