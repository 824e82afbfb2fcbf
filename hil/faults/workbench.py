"""What a person does to an emulated hand while it runs: breaks it, mends it, exchanges parts, touches it.

A `Workbench` holds the hand's faults and takes acts, at the present instant and in the thread that moves the hand.
"""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import Any

from aero.channels import Channel
from firmware_emulator.firmware.board import Board
from firmware_emulator.firmware.homing import home
from firmware_emulator.hand import EmulatedHand
from hil.faults.assembly import Active, HandAssembly
from hil.faults.by_hand import TOUCH_S, bend, turn, unloaded
from hil.faults.fault import AssemblyStage, FaultLayer, Injection, Part
from hil.faults.host import refuse_at_a_port
from hil.faults.inspection import cables_of, felt_of_digit, in_words, odd_on_bus, seen_of_cable
from hil.faults.mechanics import JOINTS, with_values
from hil.faults.schedule import Schedule, refuse_rivals
from model import BuiltHandPlant
from model.units import Unit

_LOG = logging.getLogger(__name__)
FIRES_ITSELF = (FaultLayer.BUS, FaultLayer.LINK, FaultLayer.HOST)
"""Layers whose faults have an effect only when bytes come their way."""
TOUCHING = (FaultLayer.CABLE, FaultLayer.JOINT)
"""Layers in which a fault of the set-up is something that touches the hand."""
FLASHED = (FaultLayer.FIRMWARE, FaultLayer.BOARD)
"""Layers of what the board's program does."""
BEFORE_THE_BOARD = (Part.COMPUTER, Part.DRIVER, Part.USB)
"""Parts that are replaced with the hand's power on."""
OF_A_SERVO = ("rotor_inertia", "spool_damping", "spool_friction")
"""What goes along with a servo, by channel, of the mechanics of a unit."""
EXCHANGES = {Part.SERVO: "exchange_servos", Part.BUS: "exchange_plugs"}
"""Acts that exchange a part."""
HELD_SHARE = 0.55
"""Share of its travel that a digit has around what is held."""


class Workbench:
    """An emulated hand, its faults, and whoever works on it."""

    def __init__(self, assembly: HandAssembly, schedule: Schedule) -> None:
        """Prepare for the faults of a schedule; nothing is injected yet."""
        self.assembly = assembly
        self.done: list[tuple[float, str]] = []
        """What was done, and when, s on the hand's clock."""
        self.at_a_port = False
        """Whether the hand's program is behind a port, where no fault of its own end can be put."""
        self._schedule = schedule
        self._present: dict[Injection, Active] = {}
        self._cables_off: dict[Channel, tuple[Active, list[Injection]]] = {}
        self._held: Active | None = None
        self._powered = True
        self._aside: tuple[Injection, ...] = ()
        self._exchanged: list[tuple[Part, Channel, Channel]] = []

    @property
    def mechanics(self) -> BuiltHandPlant:
        """The mechanics behind the servos."""
        return self.assembly.mechanics

    @property
    def hand(self) -> EmulatedHand:
        """The electronics."""
        return self.assembly.hand

    @property
    def present(self) -> tuple[Injection, ...]:
        """The faults that the hand has or will have at their time."""
        return tuple(self._present)

    @property
    def acts_present(self) -> tuple[str, ...]:
        """The acts that bring a whole hand into its present state."""
        return (
            *(f"{EXCHANGES[part]} {one.label} {other.label}" for part, one, other in self._exchanged),
            *(f"cable_off {channel.label}" for channel in self._cables_off),
            *["hold"] * (self._held is not None),
            # What cannot be undone, such as a restart, has happened and is no state.
            *(f"inject {fault}" for fault, active in self._present.items() if active.clear is not None),
            *["power_off"] * (not self._powered),
        )

    def build(self, stage: AssemblyStage) -> None:
        """Inject the faults of one stage of the assembly, in the order of the schedule."""
        faults = [fault for fault in self._schedule.faults if fault.fault.layer.stage is stage]
        for fault in faults:
            self._present[fault] = fault.fault.inject(self.assembly, fault)
        for fault in faults:
            if not fault.at_s:
                self._begin(fault)

    def start(self) -> None:
        """Let the faults that begin later begin at their times, counted from now."""
        kernel = self.hand.kernel
        for fault in self._schedule.faults:
            if fault.at_s:
                kernel.call_at(kernel.now + fault.at_s, self._begin, fault)

    def _begin(self, fault: Injection) -> None:
        if (active := self._present.get(fault)) is None:
            return  # it was taken away before its time
        active.begin()
        if fault.fault.layer not in FIRES_ITSELF:
            self._schedule.fire(fault)

    def inject(self, fault: Injection) -> None:
        """Break the hand now, whatever the time of the fault says.

        Raises:
            ValueError: it is built in, it is there already, or it cannot be combined with another or be in this hand.
        """
        if not fault.fault.later:
            raise ValueError(f"{fault.name} is built in and cannot begin on a running hand; give it at the opening")
        refuse_rivals((*self._present, fault))
        if self.at_a_port:
            refuse_at_a_port((fault,))
        self._put(fault)
        self._note(f"injected {fault}")

    def clear(self, fault: Injection) -> None:
        """Take a fault away, as it was before.

        Raises:
            ValueError: the hand does not have it, or it cannot be undone.
        """
        found = next((one for one in self._present if (one.fault, one.channel) == (fault.fault, fault.channel)), None)
        if found is None:
            raise ValueError(f"the hand does not have {fault.name}; it has {self.words() or 'no fault'}")
        if self._present[found].clear is None:
            raise ValueError(f"{fault.name} has happened and cannot be undone")
        self._take(found)
        self._note(f"cleared {found}")

    def words(self) -> str:
        """Return the faults of the hand, as `parse_fault` reads them, with blanks between."""
        return " ".join(map(str, self._present))

    def exchange_servos(self, one: Channel, other: Channel) -> str:
        """Exchange two servos, IDs set anew: faults of a servo go along, those of a digit stay."""
        self._exchange(Part.SERVO, one, other)
        self.hand.reset("power_on")
        return self._note(f"exchanged the servos of {one.label} and {other.label}, and set their IDs; home the hand")

    def exchange_plugs(self, one: Channel, other: Channel) -> str:
        """Exchange the bus plugs of two servos: what is wrong with a plug or its wire goes along."""
        self._exchange(Part.BUS, one, other)
        self.hand.reset("power_on")
        return self._note(f"exchanged the bus plugs of {one.label} and {other.label}")

    def _exchange(self, part: Part, one: Channel, other: Channel) -> None:
        def exchanged(unit: Unit) -> Unit:
            for field in OF_A_SERVO:
                values = list(getattr(unit.hand, field))
                values[one], values[other] = values[other], values[one]
                changed: dict[str, Any] = {field: tuple(values)}
                unit = replace(unit, hand=replace(unit.hand, **changed))
            return unit

        self._move(part, {one: other, other: one})
        if part is Part.SERVO:
            self.assembly.refound(exchanged)
        if self._exchanged and self._exchanged[-1] in ((part, one, other), (part, other, one)):
            self._exchanged.pop()
        else:
            self._exchanged.append((part, one, other))

    def cable_off(self, channel: Channel) -> str:
        """Take a cable off its spool, or the abduction's linkage off its horn: the servo then turns nothing.

        Raises:
            ValueError: it is off.
        """
        if channel in self._cables_off:
            raise ValueError(f"the cable of {channel.label} is off its spool")
        # How a cable is wound does nothing to a servo without it.
        wound = [
            fault for fault in self._present if fault.fault.layer is FaultLayer.WINDING and channel in cables_of(fault)
        ]
        for fault in wound:
            self._take(fault)
        active = self.assembly.changed(lambda unit: unloaded(unit, channel))
        active.begin()
        self._cables_off[channel] = active, wound
        return self._note(f"took the cable of {channel.label} off its spool")

    def cable_on(self, channel: Channel) -> str:
        """Wind a cable on again as it was wound.

        Raises:
            ValueError: it is on.
        """
        if channel not in self._cables_off:
            raise ValueError(f"the cable of {channel.label} is on its spool")
        active, wound = self._cables_off.pop(channel)
        active.undo()
        for fault in wound:
            self._put(fault)
        return self._note(f"put the cable of {channel.label} on its spool")

    def hold(self) -> str:
        """Put something into the hand that the digits close on.

        Raises:
            ValueError: it holds something.
        """
        if self._held is not None:
            raise ValueError("the hand holds something")
        joints = [joint for channel in Channel for joint in JOINTS[channel] if channel is not Channel.THUMB_ABDUCTION]
        self._held = self.assembly.changed(
            lambda unit: with_values(unit, "closed_stop", joints, lambda stop: HELD_SHARE * stop)
        )
        self._held.begin()
        return self._note("put something into the hand")

    def let_go(self) -> str:
        """Take away whatever the hand holds or wears, and spread digits that touch."""
        touching = [one for one in self._present if one.part is Part.SETUP and one.fault.layer in TOUCHING]
        for fault in touching:
            self._take(fault)
        there = bool(touching) or self._held is not None
        if self._held is not None:
            self._held.undo()
            self._held = None
        return self._note("took everything out of the hand" if there else "there was nothing to take out of the hand")

    def home(self) -> str:
        """Let the board home, as a program asks for it; it takes some seconds.

        Raises:
            ValueError: a firmware program on the board, which only its own driver homes.
        """
        board = self.hand.board
        if not isinstance(board, Board):
            raise ValueError("a firmware program is homed by a driver")
        board.start(home(board))
        return self._note("homing")

    def power_off(self) -> str:
        """Take the power away from board and servos."""
        self._powered = False
        self.hand.board.stop()
        for servo in self.hand.servos:
            servo.write(servo.model.places["torque_enable"].address, b"\0")
        return self._note("switched off")

    def power_on(self) -> str:
        """Give power to board and servos, which start anew; it takes some seconds."""
        self._powered = True
        self.hand.reset("power_on")
        return self._note("switched on")

    def replace(self, part: Part, channel: Channel | None = None) -> str:
        """Replace a part, or set the set-up right: its faults are gone.

        Args:
            part: to be replaced.
            channel: of a servo, digit or plug; all of them when None.
        """
        for fault in list(self._present):
            # Another board comes with the firmware that was named.
            flashed = part is Part.BOARD and fault.fault.layer is FaultLayer.FIRMWARE
            if flashed or (fault.part is part and channel in (None, fault.channel)):
                self._take(fault)
        if part is Part.SETUP:
            self.let_go()
        if part not in BEFORE_THE_BOARD:
            self.hand.reset("power_on")
        return self._note(f"replaced: {part.value}{'' if channel is None else f' of {channel.label}'}")

    def bend(self, channel: Channel) -> str:
        """Bend a digit by hand, closed and then open; how far it moved and its cable are noted when it is let go."""
        bend(self.assembly, channel, self._note)
        return self._note(f"bending {channel.label} by hand for {TOUCH_S:g} s")

    def turn(self, channel: Channel) -> str:
        """Turn a spool by hand, half a turn to close, its torque off; how far it went is noted when it is let go."""
        turn(self.assembly, channel, self._note)
        return self._note(f"turning the spool of {channel.label} by hand for {TOUCH_S:g} s, its torque off")

    def feel(self, channel: Channel) -> str:
        """Bend a digit by hand, its supply off, and say what differs from how it was."""
        return self._note(in_words(f"bent {channel.label}", felt_of_digit(self.assembly, channel)))

    def look(self, channel: Channel) -> str:
        """Look along a cable, and say what differs from how it was."""
        wound = [c for one in self._present if one.fault.layer is FaultLayer.WINDING for c in cables_of(one)]
        return self._note(in_words(f"looked at {channel.label}", seen_of_cable(self.assembly, wound, channel)))

    def registers(self) -> str:
        """Read the servos on a bus adapter, and say which IDs do not answer or answer twice."""
        return self._note(in_words("read the bus", odd_on_bus(self.assembly)))

    def flashed(self) -> str:
        """Look which firmware is on the board."""
        return self._note(f"flashed: {self.assembly.firmware}, for a {self.assembly.board_side} hand")

    def flash(self) -> str:
        """Flash the declared firmware on this board: what its program does wrong is gone, what is broken stays."""
        for fault in [one for one in self._present if one.fault.layer in FLASHED]:
            self._take(fault)
        self.hand.reset("power_on")
        return self._note("flashed the board")

    def set_aside(self, *parts: Part) -> None:
        """Use other parts for a while; `put_back` ends it."""
        self._aside = tuple(one for one in self._present if one.part in parts)
        for fault in self._aside:
            self._take(fault)

    def put_back(self) -> None:
        """Use the own parts again."""
        for fault in self._aside:
            self._put(fault)
        self._aside = ()

    def voltage(self) -> str:
        """Measure the supply at the board's plug."""
        return self._note(f"measured {self.volts():.2f} V at the plug")

    def volts(self) -> float:
        """Return what a meter shows of the supply at present, V."""
        return self.assembly.healthy.servos.voltage * self.assembly.supply_left() if self._powered else 0.0

    def _put(self, fault: Injection) -> None:
        active = fault.fault.inject(self.assembly, fault)
        self._present[fault] = active
        active.begin()

    def _take(self, fault: Injection) -> None:
        self._present.pop(fault).undo()

    def _move(self, part: Part, swap: dict[Channel, Channel]) -> None:
        """Let the faults of a part go along with it to another channel; what cannot sit there is mended on the way."""
        moved = [fault for fault in self._present if fault.part is part and fault.channel in swap]
        for fault in moved:
            self._take(fault)
        for fault in moved:
            there = swap[fault.where]
            # IDs are set anew after an exchange.
            if there in fault.fault.channels and fault.fault.excludes != "id":
                self._put(replace(fault, channel=there))

    def _note(self, text: str) -> str:
        self.done.append((self.hand.kernel.now, text))
        _LOG.info("%s", text)
        return text
