"""The emulated hand that faults are injected into: its unit, mechanics and electronics, during and after assembly."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

from firmware_emulator.firmware.hands import HandSide
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.plant import Plant
from hil.faults.fault import Fault
from hil.faults.shaft_fault import ShaftFault
from model import BuiltHandPlant
from model.units import Unit

Begin = Callable[[], object]
"""Begins a fault."""


class HandAssembly:
    """A hand under assembly. It has a unit, then mechanics, then electronics."""

    def __init__(
        self,
        unit: Unit,
        *,
        firmware: str,
        side: HandSide,
        random: Callable[[Fault], Random],
        fire: Callable[[Fault], None],
    ) -> None:
        """Start with a healthy unit.

        Args:
            unit: the hand without its faults.
            firmware: version that is declared.
            side: of the hand.
            random: returns the random numbers of one fault.
            fire: called with a fault that has an effect.
        """
        self.healthy = unit
        self.unit = unit
        """The unit with the faults of its mechanics so far."""
        self.firmware = firmware
        """Version that the board runs."""
        self.board_side = self.side = side
        """Hand that the board's firmware was made for."""
        self.random, self.fire = random, fire
        self._plant: BuiltHandPlant | None = None
        self._shafts: Plant | None = None
        self._hand: EmulatedHand | None = None
        self._on_connect: list[Callable[[EmulatedHand], object]] = []

    def build_mechanics(self, rewire: Callable[[Plant], Plant] | None) -> BuiltHandPlant:
        """Build the mechanics of the unit; `rewire` puts something in front of them."""
        self._plant = BuiltHandPlant(self.unit.hand, hand=self.side)
        self._shafts = self._plant if rewire is None else rewire(self._plant)
        return self._plant

    def connect(self, hand: EmulatedHand) -> None:
        """Take the electronics, which now drive the shafts."""
        self._hand = hand
        for call in self._on_connect:
            call(hand)

    def on_connect(self, call: Callable[[EmulatedHand], object]) -> None:
        """Call this with the electronics when they are there."""
        self._on_connect.append(call)

    @property
    def shafts(self) -> Plant:
        """What the servos turn: the mechanics behind all shaft faults."""
        assert self._shafts is not None, "the mechanics are not built yet"
        return self._shafts

    @property
    def hand(self) -> EmulatedHand:
        """The electronics."""
        assert self._hand is not None, "the electronics are not there yet"
        return self._hand

    def rebuild(self, change: Callable[[Unit], Unit]) -> None:
        """Change the unit, and the mechanics where they are built."""
        self._advance()
        self.unit = change(self.unit)
        if self._plant is not None:
            self._plant.become(self.unit.hand)

    def insert(self, shaft_fault: ShaftFault) -> Begin:
        """Insert a fault between servos and shafts; it has no effect until what is returned is called."""
        self._shafts = shaft_fault

        def begin() -> None:
            self._advance()
            shaft_fault.begin()

        return begin

    def _advance(self) -> None:
        """Bring the mechanics up to the present time of the electronics."""
        if self._hand is not None:
            self._hand.advance_plant()


Injector = Callable[[HandAssembly, Fault], Begin]
"""Injects a fault into a hand, and returns what begins it at its time."""


def at_once(act: Callable[[EmulatedHand, Fault], object]) -> Injector:
    """Return the injector of a fault that acts on the electronics when it begins."""
    return lambda assembly, fault: lambda: act(assembly.hand, fault)
