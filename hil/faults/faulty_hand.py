"""An emulated hand with injected faults, each on its channel and at its time."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import Any

from firmware_emulator.firmware.board import Board
from firmware_emulator.firmware.hands import HANDS, HandSide
from firmware_emulator.firmware.nvs import Nvs
from firmware_emulator.hand import EmulatedHand, Start
from firmware_emulator.plant import Plant
from hil.faults import answers, board, encoder, mechanics, motor, servo, supply
from hil.faults.assembly import Begin, HandAssembly, Injector
from hil.faults.fault import Fault
from hil.faults.link import LinkFaults
from hil.faults.schedule import Schedule
from model import BuiltHandPlant
from model.units import Unit

BEFORE_MECHANICS: dict[str, Injector] = mechanics.INJECTORS | board.BUILT_IN
ON_SHAFTS: dict[str, Injector] = supply.INJECTORS | motor.INJECTORS | encoder.INJECTORS
ON_ELECTRONICS: dict[str, Injector] = servo.INJECTORS | board.INJECTORS
INJECTORS = BEFORE_MECHANICS | ON_SHAFTS | ON_ELECTRONICS | answers.INJECTORS
"""Injector of every fault of a hand; its link's faults have none."""


class FaultyHand(EmulatedHand):
    """Electronics with faults of the link, and with a board that may be made for the other hand."""

    link_faults: LinkFaults | None = None

    def __init__(self, plant: Plant, *, board_side: HandSide, hand: HandSide, **settings: Any) -> None:
        """Put the electronics on a plant.

        Args:
            plant: what the servos turn.
            board_side: hand that the firmware was made for.
            hand: side of the hand.
            settings: further ones of `EmulatedHand`.
        """
        self._board_side = board_side
        super().__init__(plant, hand=hand, **settings)

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
        self._config = HANDS[self._board_side]
        return super()._new_board()


def build_faulty(
    unit: Unit,
    schedule: Schedule,
    *,
    firmware: str,
    hand: HandSide,
    seed: int,
    start: Start = "homed",
    nvs: Nvs | None = None,
    program: Path | None = None,
    rewire: Callable[[Plant], Plant] | None = None,
) -> tuple[FaultyHand, BuiltHandPlant]:
    """Return the electronics of an emulated hand with faults, and the mechanics behind them.

    Args:
        unit: the hand without its faults.
        schedule: of the faults; their times count from the moment at which the hand is ready.
        firmware: version that is declared.
        hand: side.
        seed: of the noise.
        start: state of the board, as for `EmulatedHand`.
        nvs: what the board has stored.
        program: firmware program on the board.
        rewire: puts something between servos and mechanics.

    Raises:
        ValueError: a fault cannot be injected into this hand; an unknown firmware or side.
    """
    if program is not None and (refused := schedule.of("firmware")):
        raise ValueError(f"{refused[0]} cannot be put into a firmware program; leave out the program or the fault")
    assembly = HandAssembly(unit, firmware=firmware, side=hand, random=schedule.random, fire=schedule.fire)
    built = {fault: INJECTORS[fault.name](assembly, fault) for fault in _of(schedule, BEFORE_MECHANICS)}
    _begin_from_the_start(built, schedule)
    plant = assembly.build_mechanics(rewire)
    on_shafts = {fault: INJECTORS[fault.name](assembly, fault) for fault in _of(schedule, ON_SHAFTS)}
    _begin_from_the_start(on_shafts, schedule)
    electronics = FaultyHand(
        assembly.shafts,
        servos=assembly.unit.servos,
        firmware=assembly.firmware,
        hand=hand,
        board_side=assembly.board_side,
        seed=seed,
        start=start,
        nvs=nvs,
        program=program,
    )
    assembly.connect(electronics)
    ready = {
        fault: INJECTORS[fault.name](assembly, fault) for fault in _of(schedule, ON_ELECTRONICS | answers.INJECTORS)
    }
    begins = built | on_shafts | ready
    for fault in _of(schedule, INJECTORS):
        if fault.at_s:
            electronics.kernel.call_at(electronics.kernel.now + fault.at_s, _begin, fault, begins[fault], schedule)
        elif fault in ready:
            _begin(fault, begins[fault], schedule)
    if link := schedule.of("link"):
        _inject_on_link(electronics, link, schedule)
    return electronics, plant


def _of(schedule: Schedule, names: Collection[str]) -> Iterator[Fault]:
    return (fault for fault in schedule.faults if fault.name in names)


def _begin_from_the_start(begins: dict[Fault, Begin], schedule: Schedule) -> None:
    for fault, begin in begins.items():
        if not fault.at_s:
            _begin(fault, begin, schedule)


def _begin(fault: Fault, begin: Begin, schedule: Schedule) -> None:
    begin()
    if fault.name not in answers.INJECTORS:  # those fire when they first change an answer
        schedule.fire(fault)


def _inject_on_link(hand: FaultyHand, faults: Collection[Fault], schedule: Schedule) -> None:
    hand.link_faults = on_link = LinkFaults(
        tuple(faults), start_s=hand.kernel.now, random=schedule.random, fired=schedule.fire
    )

    def insert() -> None:
        if text := on_link.inserted(hand.kernel.now):
            hand.say(text)

    for t in on_link.times():
        hand.kernel.call_at(t, insert)
