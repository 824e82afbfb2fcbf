"""Emulated hand under assembly, into which faults are injected: unit, mechanics and electronics."""

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from random import Random

from firmware_emulator.firmware.hands import Side
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.plant import Plant
from hil.emulated.faults.link_faults import LinkFaults
from hil.emulated.faults.shaft_fault import ShaftFault
from model import BuiltHandPlant
from model.units import Unit

Change = Callable[[Unit], Unit]
"""Maps a unit to the unit with a fault."""


@dataclass(frozen=True)
class Active:
    """Handle of an injected fault, which may not have begun."""

    begin: Callable[[], object]
    clear: Callable[[], object] | None = None
    """Clears the fault; None for a momentary fault, such as a restart."""

    def undo(self) -> None:
        """Clear the fault, if it is clearable."""
        if self.clear is not None:
            self.clear()


class HandAssembly:
    """Hand under assembly: first a unit, then mechanics, then electronics."""

    def __init__(
        self,
        unit: Unit,
        *,
        firmware: str,
        side: Side,
        random: Callable[[Hashable], Random],
        fire: Callable[[Hashable], None],
    ) -> None:
        """Start with a healthy unit.

        Args:
            unit: parameters of the healthy hand.
            firmware: declared version.
            side: side of the hand.
            random: returns the random generator of one injection.
            fire: called with each injection that has an effect.
        """
        self.healthy = self.unit = unit
        """Parameters of the healthy hand (`healthy`), and of the hand with its present faults (`unit`)."""
        self.firmware = firmware
        self.board_side = self.side = side
        """Side of the board's firmware, and of the hand."""
        self.random, self.fire = random, fire
        self.link = LinkFaults(fire)
        """Active faults of the link between host and board."""
        self.stalls: list[tuple[Hashable, float, Random]] = []
        """Faults that stall the program: fault, duration of one stall, s, and random generator."""
        self._changes: list[Change] = []
        self._between: list[ShaftFault] = []
        self._mechanics: BuiltHandPlant | None = None
        self._nearest: Plant | None = None
        self._electronics: EmulatedHand | None = None

    def build_mechanics(self, plant: BuiltHandPlant, rewire: Callable[[Plant], Plant] | None) -> None:
        """Set the mechanics of the unit; `rewire` wraps them in a plant that faults do not see."""
        self._mechanics = plant
        self._nearest = plant if rewire is None else rewire(plant)

    def connect(self, electronics: EmulatedHand) -> None:
        """Set the electronics, which now drive the shafts."""
        self._electronics = electronics

    @property
    def mechanics(self) -> BuiltHandPlant:
        """Mechanics behind all shaft faults."""
        assert self._mechanics is not None, "the mechanics are not built yet"
        return self._mechanics

    @property
    def shafts(self) -> Plant:
        """Plant driven by the servos: the outermost shaft fault, or the mechanics."""
        assert self._nearest is not None, "the mechanics are not built yet"
        return self._between[-1] if self._between else self._nearest

    @property
    def electronics(self) -> EmulatedHand:
        """Electronics of the hand, asserted to be connected."""
        assert self._electronics is not None, "the electronics are not there yet"
        return self._electronics

    def now(self) -> float:
        """Return the present time of the electronics, s."""
        return self.electronics.kernel.now

    @property
    def is_running(self) -> bool:
        """True if the electronics are connected."""
        return self._electronics is not None

    def changed(self, change: Change) -> Active:
        """Return the handle of a parameter change; `begin` also updates the mechanics, if built."""

        def begin() -> None:
            self._changes.append(change)
            self._rebuild()

        def clear() -> None:
            if change in self._changes:
                self._changes.remove(change)
                self._rebuild()

        return Active(begin, clear)

    def refound(self, change: Change) -> None:
        """Change the healthy hand, for example by an exchange of two parts."""
        self.healthy = change(self.healthy)
        self._rebuild()

    def insert(self, fault: ShaftFault) -> Active:
        """Insert a fault between servos and shafts, without effect until `begin` of the returned handle."""
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

    def flash(self, firmware: str, side: Side) -> None:
        """Flash a firmware for a side on the board, which restarts."""
        self.firmware, self.board_side = firmware, side
        self.electronics.flash(firmware, side)

    def supply_left(self) -> float:
        """Return the present supply voltage under load, as a fraction of nominal."""
        left = self.mechanics.compiled.supply
        for fault in self._between:
            left *= fault.supply_left
        return left

    def advance(self) -> None:
        """Advance the mechanics to the present time of the electronics."""
        if self._electronics is not None:
            self._electronics.advance_plant()

    def _rebuild(self) -> None:
        self.advance()
        self.unit = self.healthy
        for change in self._changes:
            self.unit = change(self.unit)
        if self._mechanics is not None:
            self._mechanics.become(self.unit.hand)

    def _reconnect(self) -> None:
        if self._electronics is not None:
            self._electronics.chain.shafts.connect(self.shafts)
