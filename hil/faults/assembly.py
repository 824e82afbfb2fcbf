"""The emulated hand that faults are injected into, during and after assembly: its unit, mechanics and electronics."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from random import Random

from firmware_emulator.firmware.hands import HandSide
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.plant import Plant
from hil.faults.link_faults import LinkFaults
from hil.faults.shaft_fault import ShaftFault
from model import BuiltHandPlant
from model.units import Unit

Change = Callable[[Unit], Unit]
"""Makes the unit with a fault of the one without."""


@dataclass(frozen=True)
class Active:
    """A fault that was injected, before and after it begins."""

    begin: Callable[[], object]
    """Lets it have its effect from now on."""
    clear: Callable[[], object] | None = None
    """Takes it away; None for what cannot be undone, such as a restart."""

    def undo(self) -> None:
        """Take it away, where that can be."""
        if self.clear is not None:
            self.clear()


class HandAssembly:
    """A hand under assembly. It has a unit, then mechanics, then electronics."""

    def __init__(
        self,
        unit: Unit,
        *,
        firmware: str,
        side: HandSide,
        random: Callable[[Hashable], Random],
        fire: Callable[[Hashable], None],
    ) -> None:
        """Start with a healthy unit.

        Args:
            unit: the hand without its faults.
            firmware: version that is declared.
            side: of the hand.
            random: returns the random numbers of one injection.
            fire: called with an injection that has an effect.
        """
        self.healthy = self.unit = unit
        """The hand without its faults, and with those of its mechanics so far."""
        self.firmware = firmware
        """Version that the board runs."""
        self.board_side = self.side = side
        """Hand that the board's firmware was made for."""
        self.random, self.fire = random, fire
        self.link = LinkFaults(fire)
        """What acts on the bytes between host and board."""
        self.stalls: list[tuple[Hashable, float, Random]] = []
        """Faults that hold the program up: for how long each time, s, and their random numbers."""
        self._changes: list[Change] = []
        self._between: list[ShaftFault] = []
        self._mechanics: BuiltHandPlant | None = None
        self._nearest: Plant | None = None
        self._hand: EmulatedHand | None = None

    def build_mechanics(self, plant: BuiltHandPlant, rewire: Callable[[Plant], Plant] | None) -> None:
        """Take the mechanics of the unit; `rewire` puts something in front of them that no fault knows."""
        self._mechanics = plant
        self._nearest = plant if rewire is None else rewire(plant)

    def connect(self, hand: EmulatedHand) -> None:
        """Take the electronics, which now drive the shafts."""
        self._hand = hand

    @property
    def mechanics(self) -> BuiltHandPlant:
        """What turns behind all shaft faults."""
        assert self._mechanics is not None, "the mechanics are not built yet"
        return self._mechanics

    @property
    def shafts(self) -> Plant:
        """What the servos turn: the mechanics behind all shaft faults."""
        assert self._nearest is not None, "the mechanics are not built yet"
        return self._between[-1] if self._between else self._nearest

    @property
    def hand(self) -> EmulatedHand:
        """The electronics."""
        assert self._hand is not None, "the electronics are not there yet"
        return self._hand

    def now(self) -> float:
        """Return the present time of the electronics, s."""
        return self.hand.kernel.now

    @property
    def is_running(self) -> bool:
        """Whether the electronics are there."""
        return self._hand is not None

    def changed(self, change: Change) -> Active:
        """Return a fault that is another unit; the mechanics follow where they are built."""

        def begin() -> None:
            self._changes.append(change)
            self._rebuild()

        def clear() -> None:
            if change in self._changes:
                self._changes.remove(change)
                self._rebuild()

        return Active(begin, clear)

    def refound(self, change: Change) -> None:
        """Make another hand of the one without faults, as when two of its parts are exchanged."""
        self.healthy = change(self.healthy)
        self._rebuild()

    def insert(self, fault: ShaftFault) -> Active:
        """Insert a fault between servos and shafts; it has no effect until it begins."""
        fault.behind = self.shafts
        self._between.append(fault)
        self._reconnect()

        def begin() -> None:
            self.advance()
            fault.begin()

        def clear() -> None:
            self.advance()
            at = self._between.index(fault)
            for behind, following in zip([fault.behind], self._between[at + 1 : at + 2], strict=False):
                following.behind = behind
            del self._between[at]
            fault.end()
            self._reconnect()

        return Active(begin, clear)

    def flash(self, firmware: str, side: HandSide) -> None:
        """Put another firmware on the board, which restarts."""
        self.firmware, self.board_side = firmware, side
        self.hand.flash(firmware, side)

    def supply_left(self) -> float:
        """Return the share of the nominal supply that is left at present under load."""
        left = self.mechanics.compiled.supply
        for fault in self._between:
            left *= fault.supply_left
        return left

    def advance(self) -> None:
        """Bring the mechanics up to the present time of the electronics."""
        if self._hand is not None:
            self._hand.advance_plant()

    def _rebuild(self) -> None:
        self.advance()
        self.unit = self.healthy
        for change in self._changes:
            self.unit = change(self.unit)
        if self._mechanics is not None:
            self._mechanics.become(self.unit.hand)

    def _reconnect(self) -> None:
        if self._hand is not None:
            self._hand.chain.shafts.connect(self.shafts)
