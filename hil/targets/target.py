"""Target of a test or an experiment: one hand, physical or emulated, behind one interface.

An experiment never depends on the kind of target. Features of some targets only are capabilities, which `Target.get`
returns by class.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TypeVar

from aero.actuation import ActuationMap
from aero.channels import Channel
from aero.clock import Clock, WallClock
from aero.firmware import firmware_of
from aero.hand import Hand
from aero.safety import GuardedHand, WatchedClock
from aero.side import Side
from firmware_emulator.hand import EmulatedHand
from hil.dialogue.asker import Choice
from hil.emulated.faults.bench import HandBench
from hil.emulated.faults.catalogue import parse_fault
from hil.emulated.faults.fault import Injection
from hil.emulated.faults.workbench import Workbench
from hil.targets.delays import DelayLog
from hil.targets.hand_errors import MissingCapabilityError
from hil.targets.hand_spec import hand_words
from hil.targets.wire_log import WireLog
from model import BuiltHandPlant

Capability = TypeVar("Capability")


@dataclass(frozen=True)
class GroundTruth:
    """Capability of an emulated hand in this process: its true state, independent of its readings."""

    plant: BuiltHandPlant
    """Mechanics: joint angles, cable tensions, slack."""
    electronics: EmulatedHand
    """Electronics: board, bus and servos."""


@dataclass(frozen=True)
class Onlooker:
    """Capability of visual inspection: a person who answers questions about the hand."""

    answer: Callable[[Choice[str]], str]
    """Returns the answer; raises `KeyboardInterrupt` if the dialogue has ended."""


@dataclass(frozen=True, repr=False)
class Target:
    """Open hand, ready for commands, with its description and logs."""

    name: str
    """Value of `--hil`."""
    hand: Hand
    clock: Clock
    map: ActuationMap
    firmware: str
    side: Side
    unit: str
    """Unit file of an emulated hand, `physical` for a hand on a port."""
    seed: int
    hand_id: str
    """Name or serial number of the individual hand; empty if unknown."""
    wire: WireLog
    """Log of the bytes since the target was opened."""
    delays: DelayLog
    """Scheduling delays of this program and an emulated board since the opening; empty on virtual time."""
    capabilities: tuple[object, ...] = ()
    """Objects that `get` finds by class."""
    serial_number: str = ""
    """Serial number of the hand's USB port; empty if unknown."""
    faults: tuple[Injection, ...] = ()
    """Faults that an emulated hand was opened with."""

    def __repr__(self) -> str:
        """Return one line, because pytest prints it for a failed test."""
        return f"<Target: {self.describe()}>"

    @property
    def real_time(self) -> bool:
        """True if hand time is real time."""
        return isinstance(self.clock.bare if isinstance(self.clock, WatchedClock) else self.clock, WallClock)

    @property
    def guard(self) -> GuardedHand | None:
        """Guarded hand, or None for an unguarded hand."""
        return self.hand if isinstance(self.hand, GuardedHand) else None

    @property
    def may_push_at_stops(self) -> bool:
        """True if the thumb may push at its end stops: unguarded, or with a firmware whose torque can be reduced."""
        return self.guard is None or firmware_of(self.firmware).settings is not None

    def begin(self, *, stops: Iterable[Channel] = ()) -> None:
        """Check and open a guarded hand before an experiment starts its clock; do nothing for an unguarded hand.

        Args:
            stops: channels that the experiment drives into their end stops, with reduced torque.

        Raises:
            SafetyStopError: the guard refuses to move the hand, or the hand did not open.
        """
        if self.guard is not None:
            self.guard.expect_stops(stops)

    def find(self, capability: type[Capability]) -> Capability | None:
        """Return a capability, or None if this target lacks it."""
        return next((found for found in self.capabilities if isinstance(found, capability)), None)

    def get(self, capability: type[Capability]) -> Capability:
        """Return a capability, such as `GroundTruth`.

        Raises:
            MissingCapabilityError: this target lacks the capability.
        """
        found = self.find(capability)
        if found is None:
            raise MissingCapabilityError(f"{self.name} has no {capability.__name__}; run with --hil=emulated for it")
        return found

    @property
    def wrong(self) -> tuple[Injection, ...]:
        """Present faults of an emulated hand."""
        # In this process, objects instead of text: a fault outside the catalogue cannot be parsed back.
        if (here := self.find(Workbench)) is not None:
            return here.present
        bench = self.find(HandBench)
        return self.faults if bench is None else bench.state().present

    def inject(self, fault: Injection | str) -> None:
        """Inject a fault into an emulated hand now, as in `target.inject("motor_dead:ring")`.

        Raises:
            MissingCapabilityError: the hand is not emulated.
            ValueError: unknown fault, or a fault that this hand refuses.
        """
        asked = parse_fault(fault) if isinstance(fault, str) else fault
        if (here := self.find(Workbench)) is not None:
            here.inject(asked)
        else:
            self.act(f"inject {asked}")

    def clear(self, fault: Injection | str) -> None:
        """Clear a fault of an emulated hand.

        Raises:
            MissingCapabilityError: the hand is not emulated.
            ValueError: the hand does not have the fault, or the fault cannot be undone.
        """
        asked = parse_fault(fault) if isinstance(fault, str) else fault
        if (here := self.find(Workbench)) is not None:
            here.clear(asked)
        else:
            self.act(f"clear {asked}")

    def act(self, words: str) -> str:
        """Perform an act of `hil.emulated.faults.acts.ACTS`, as in `target.act("exchange_servos ring pinky")`.

        Returns a sentence about the act.

        Raises:
            MissingCapabilityError: the hand is not emulated.
            ValueError: unknown act, or an act that this hand refuses.
        """
        return self.get(HandBench).act(words)

    def describe(self) -> str:
        """Return a description of the hand in one line."""
        wrong = ", ".join(map(str, self.wrong))
        return hand_words(
            self.side, self.name, self.firmware, unit=self.unit, seed=self.seed, hand_id=self.hand_id, wrong=wrong
        )
