"""An emulated hand with faults put in: each at its place, each at its time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any

from firmware_emulator.firmware.board import Board
from firmware_emulator.firmware.hands import HANDS, HandSide
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.plant import Plant
from hil.faults import answers, board, encoder, mechanics, motor, servo, supply
from hil.faults.answers import SpoiledAnswers
from hil.faults.fault import Fault
from hil.faults.link import LinkFaults
from hil.faults.schedule import Schedule
from hil.faults.shaft_layer import ShaftLayer
from hil.faults.supply import BROWNS_OUT, Sagging, Supply
from model import BuiltHandPlant
from model.units import Unit

LAYERS = supply.EFFECTS | motor.EFFECTS | encoder.EFFECTS
AT_ONCE: dict[str, Callable[[EmulatedHand, Fault], None]] = servo.EFFECTS | board.EFFECTS
"""What is done to the electronics when a fault begins."""


class FaultyHand(EmulatedHand):
    """Electronics whose link does to bytes what its faults say, with a board that may be another hand's."""

    link_faults: LinkFaults | None = None

    def __init__(self, plant: Plant, *, board_side: HandSide | None = None, **how: Any) -> None:
        """Put the electronics on a plant; `board_side` is the hand that the firmware was made for, where another."""
        self._board_side = board_side
        super().__init__(plant, **how)

    def receive(self, data: bytes) -> None:
        """Take bytes from the host, such as reach the board."""
        if self.link_faults is None:
            super().receive(data)
            return
        for t, piece in self.link_faults.passed("to_hand", self.kernel.now, data):
            if t <= self.kernel.now:
                super().receive(piece)
            else:
                self.kernel.call_at(t, super().receive, piece)

    def say(self, data: bytes) -> None:
        """Send bytes to the host that no fault acts on."""
        self.on_transmit(data)

    def _transmit(self, data: bytes) -> None:
        if self.link_faults is None:
            self.say(data)
            return
        for t, piece in self.link_faults.passed("from_hand", self.kernel.now, data):
            if t <= self.kernel.now:
                self.say(piece)
            else:
                self.kernel.call_at(t, self.say, piece)

    def _new_board(self) -> Board:
        if self._board_side is not None:
            self._config = HANDS[self._board_side]
        return super()._new_board()


def build_faulty(unit: Unit, schedule: Schedule, **how: Any) -> tuple[FaultyHand, BuiltHandPlant]:
    """Return the electronics of an emulated hand with faults, and the mechanics behind them.

    Args:
        unit: the hand without its faults.
        schedule: of the faults; their times count from the moment at which the hand is ready.
        how: `firmware`, `hand`, `seed`, `start`, `nvs`, `program` of `EmulatedHand`, and `rewire`, which puts
            something between servos and mechanics.

    Raises:
        ValueError: a fault cannot be put into this hand; an unknown firmware or side.
    """
    declared, rewire = how["firmware"], how.pop("rewire", None)
    if how.get("program") is not None and (refused := schedule.of("firmware")):
        raise ValueError(f"{refused[0]} cannot be put into a firmware program; leave out the program or the fault")
    built = unit
    for fault in _from_the_start(schedule, mechanics.EFFECTS):
        built = mechanics.EFFECTS[fault.name](built, fault)
    for fault in schedule.of("firmware"):
        if fault.name.startswith(board.RUNS):
            how["firmware"] = fault.name.removeprefix(board.RUNS)
            if how["firmware"] == declared:
                raise ValueError(f"a board that runs {declared} as declared is no fault; declare another firmware")
            schedule.fire(fault)
        elif fault.name == board.WRONG_SIDE:
            how["board_side"] = board.OTHER_SIDE[how["hand"]]
            schedule.fire(fault)
    plant = BuiltHandPlant(built.hand, hand=how["hand"])
    behind: Plant = plant if rewire is None else rewire(plant)
    layers: dict[Fault, ShaftLayer] = {}
    for fault in schedule.faults:
        if fault.name in LAYERS:
            behind = layers[fault] = LAYERS[fault.name](behind, fault, unit, schedule.random(fault))
    for fault in _from_the_start(schedule, LAYERS):
        layers[fault].begin()
    hand = FaultyHand(behind, servos=built.servos, **how)
    for fault, layer in layers.items():
        if isinstance(layer, Sagging):
            told = Supply(hand, built.servos.voltage, feeds_board=fault.name == BROWNS_OUT)
            layer.told = told.changed
    _begin(hand, plant, built, layers, schedule)
    return hand, plant


def _from_the_start(schedule: Schedule, names: Iterable[str]) -> Iterator[Fault]:
    """Go through the faults of these names that the hand is built with; they have fired."""
    for fault in schedule.faults:
        if fault.name in names and not fault.at_s:
            schedule.fire(fault)
            yield fault


def _begin(
    hand: FaultyHand, plant: BuiltHandPlant, unit: Unit, layers: dict[Fault, ShaftLayer], schedule: Schedule
) -> None:
    """Put in what is not built in, each fault at its time from now on."""
    spoiled = SpoiledAnswers(hand.kernel, schedule.fire)
    start_s, unit_now = hand.kernel.now, [unit]

    def break_mechanics(fault: Fault) -> None:
        hand.advance_plant()
        unit_now[0] = mechanics.EFFECTS[fault.name](unit_now[0], fault)
        plant.become(unit_now[0].hand)

    def begin_layer(fault: Fault) -> None:
        hand.advance_plant()
        layers[fault].begin()

    def spoil(fault: Fault) -> None:
        hand.bus.tap = spoiled
        spoiled.add(fault, schedule.random(fault))

    beginnings: dict[str, Callable[[Fault], None]] = {
        **dict.fromkeys(mechanics.EFFECTS, break_mechanics),
        **dict.fromkeys(LAYERS, begin_layer),
        **dict.fromkeys(answers.EFFECTS, spoil),
        **{name: partial(effect, hand) for name, effect in AT_ONCE.items()},
    }

    def begin(fault: Fault) -> None:
        beginnings[fault.name](fault)
        if fault.name not in answers.EFFECTS:
            schedule.fire(fault)

    for fault in schedule.faults:
        if fault.name in beginnings and (fault.at_s or fault not in schedule.fired()):
            if fault.at_s:
                hand.kernel.call_at(start_s + fault.at_s, begin, fault)
            else:
                begin(fault)
    if link := schedule.of("link"):
        hand.link_faults = faults = LinkFaults(link, start_s=start_s, random=schedule.random, fired=schedule.fire)

        def insert() -> None:
            if text := faults.inserted(hand.kernel.now):
                hand.say(text)

        for t in faults.times():
            hand.kernel.call_at(t, insert)
