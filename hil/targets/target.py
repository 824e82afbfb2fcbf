"""A target: one hand, real or emulated, as a test or an experiment sees it.

An experiment sees a `Target` and never asks which kind it is. What only some targets have is a capability, a class that
`Target.get` is asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TypeVar

from aero.actuation import ActuationMap
from aero.channels import Channel
from aero.clock import Clock, WallClock
from aero.exit_code import Exit
from aero.firmware import firmware_of
from aero.hand import Hand
from aero.safety import GuardedHand, WatchedClock
from firmware_emulator.hand import EmulatedHand
from hil.faults.bench import HandBench
from hil.faults.catalogue import parse_fault
from hil.faults.fault import Injection
from hil.faults.workbench import Workbench
from hil.targets.asker import Choice
from hil.targets.delays import DelayLog
from hil.targets.hand_spec import hand_words
from hil.targets.wire_log import WireLog
from model import BuiltHandPlant
from model.geometry import Side

Capability = TypeVar("Capability")


class NoHandError(Exception):
    """No hand answers at the target; the message names it and says what to try."""

    exit_code = Exit.NO_HAND


class MissingCapabilityError(Exception):
    """The target cannot do what was asked for; the message says which could."""

    exit_code = Exit.USAGE


@dataclass(frozen=True)
class GroundTruth:
    """Capability of an emulated hand in this process: what it really does, whatever it reports."""

    plant: BuiltHandPlant
    """The mechanics: joint angles, cable tensions, slack."""
    electronics: EmulatedHand
    """Board, bus and servos."""


@dataclass(frozen=True)
class Onlooker:
    """Capability: somebody who looks at the hand and answers questions, for what no encoder can see."""

    answer: Callable[[Choice[str]], str]
    """Returns the answer; raises `KeyboardInterrupt` when nobody answers any more."""


class LookEndedError(KeyboardInterrupt):
    """The person ended the visual inspection; the hand was opened."""


@dataclass(frozen=True, repr=False)
class Target:
    """One hand, ready to be commanded, and everything an experiment may know about it."""

    name: str
    """What `--hil` was."""
    hand: Hand
    clock: Clock
    map: ActuationMap
    firmware: str
    side: Side
    unit: str
    """Unit file of an emulated hand, `physical` for one on a port."""
    seed: int
    hand_id: str
    """Name or serial number of the individual hand, empty when it is not known."""
    wire: WireLog
    """Everything that crossed the link since it was opened."""
    delays: DelayLog
    """How late this program and an emulated board were since then; on virtual time nothing is late."""
    capabilities: tuple[object, ...] = ()
    """What `get` finds."""
    serial_number: str = ""
    """Of the USB port that the hand is on; empty where it has none."""
    faults: tuple[Injection, ...] = ()
    """What was made wrong with an emulated hand."""

    def __repr__(self) -> str:
        """Return one line, for a failing test shows it."""
        return f"<Target: {self.describe()}>"

    @property
    def real_time(self) -> bool:
        """Whether a second of hand time costs a second."""
        return isinstance(self.clock.bare if isinstance(self.clock, WatchedClock) else self.clock, WallClock)

    @property
    def guard(self) -> GuardedHand | None:
        """The hand, when it is guarded."""
        return self.hand if isinstance(self.hand, GuardedHand) else None

    @property
    def may_push_at_stops(self) -> bool:
        """Whether the thumb may be held at its stops: a guard stops a hand that cannot be weakened for it."""
        return self.guard is None or firmware_of(self.firmware).settings is not None

    def begin(self, *, stops: Iterable[Channel] = ()) -> None:
        """Let a guarded hand be checked and opened before the clock of an experiment starts; others need nothing.

        Args:
            stops: channels that the experiment drives into their stops, and that are weakened for it.

        Raises:
            SafetyStopError: it must not be moved, or did not open.
        """
        if self.guard is not None:
            self.guard.expect_stops(stops)

    def find(self, capability: type[Capability]) -> Capability | None:
        """Return a capability, None when this target does not have it."""
        return next((found for found in self.capabilities if isinstance(found, capability)), None)

    def get(self, capability: type[Capability]) -> Capability:
        """Return a capability, such as `GroundTruth`.

        Raises:
            MissingCapabilityError: this target does not have it.
        """
        found = self.find(capability)
        if found is None:
            raise MissingCapabilityError(f"{self.name} has no {capability.__name__}; run with --hil=emulated for it")
        return found

    @property
    def wrong(self) -> tuple[Injection, ...]:
        """What is wrong with an emulated hand at present."""
        # Text does not bring back a fault that is in no catalogue.
        if (here := self.find(Workbench)) is not None:
            return here.present
        bench = self.find(HandBench)
        return self.faults if bench is None else bench.state().present

    def inject(self, fault: Injection | str) -> None:
        """Break an emulated hand now, as in `target.inject("motor_dead:ring")`.

        Raises:
            MissingCapabilityError: the hand is not an emulated one.
            ValueError: there is no such fault, or this hand cannot have it now.
        """
        asked = parse_fault(fault) if isinstance(fault, str) else fault
        if (here := self.find(Workbench)) is not None:
            here.inject(asked)
        else:
            self.act(f"inject {asked}")

    def clear(self, fault: Injection | str) -> None:
        """Take a fault away.

        Raises:
            MissingCapabilityError: the hand is not an emulated one.
            ValueError: the hand does not have it, or it cannot be undone.
        """
        asked = parse_fault(fault) if isinstance(fault, str) else fault
        if (here := self.find(Workbench)) is not None:
            here.clear(asked)
        else:
            self.act(f"clear {asked}")

    def act(self, words: str) -> str:
        """Do to an emulated hand what a person does, as in `target.act("exchange_servos ring pinky")`.

        Returns what was done; `hil.faults.acts.ACTS` lists what there is.

        Raises:
            MissingCapabilityError: the hand is not an emulated one.
            ValueError: there is no such act, or it cannot be done now.
        """
        return self.get(HandBench).act(words)

    def describe(self) -> str:
        """Say in one line what this is."""
        wrong = ", ".join(map(str, self.wrong))
        return hand_words(
            self.side, self.name, self.firmware, unit=self.unit, seed=self.seed, hand_id=self.hand_id, wrong=wrong
        )
